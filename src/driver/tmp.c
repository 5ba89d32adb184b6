#include "driver.h"
PetscErrorCode CommandTrain(void)
{
  return 0;
}
#include "driver.h"
PetscErrorCode CommandPredict(void)
{
  return 0;
}
#include "driver.h"
PetscErrorCode CommandCompare(void)
{
  return 0;
}
#include "driver.h"
PetscErrorCode CommandView(void)
{
  return 0;
}
