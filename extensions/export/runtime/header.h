/* Names and units; ranges of the parameters, in which the model was trained. */
extern const char *const MODEL_parameter_name[MODEL_N_PARAMETERS], *const MODEL_parameter_unit[MODEL_N_PARAMETERS];
extern const char *const MODEL_output_name[MODEL_N_OUTPUTS], *const MODEL_output_unit[MODEL_N_OUTPUTS];
extern const double MODEL_lo[MODEL_N_PARAMETERS], MODEL_hi[MODEL_N_PARAMETERS];

typedef struct {
  double output[MODEL_N_OUTPUTS];
  double kkt;     /* the largest residual of the contact problem, recomputed, relative */
  int iterations; /* of the active set */
} MODEL_result;

/* MODEL_OK; MODEL_OUTSIDE: parameters outside the ranges, results are those of the equations there, untested;
   MODEL_DIVERGED: no solution was found, results are of no use; MODEL_NO_MEMORY: no results. */
enum { MODEL_OK, MODEL_OUTSIDE, MODEL_DIVERGED, MODEL_NO_MEMORY };
