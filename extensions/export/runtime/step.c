void MODEL_start(MODEL_state *state)
{
  memset(state, 0, sizeof(*state));
}

int MODEL_step(const double mu[MODEL_N_PARAMETERS], double t, MODEL_state *state, MODEL_result *result, void *work)
{
  return step(mu, t, state->value, result, work);
}
