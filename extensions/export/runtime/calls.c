size_t MODEL_work_size(void)
{
  return work_size(&model);
}

/* From a state; the results in out. */
static int step(const double mu[], double t, double state[], MODEL_result *result, void *work)
{
  void *memory = work ? work : malloc(work_size(&model));
  int status, outside = 0;
  Work o;

  if (!memory) return NO_MEMORY;
  for (int p = 0; p < MODEL_N_PARAMETERS; p++) outside = outside || !(mu[p] >= MODEL_lo[p] && mu[p] <= MODEL_hi[p]);
  place(&model, memory, &o);
  status = advance(&model, &o, mu, t, state, result->output, &result->kkt, &result->iterations);
  if (!work) free(memory);
  return status == OK && outside ? OUTSIDE : status;
}
