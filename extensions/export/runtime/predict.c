int MODEL_predict(const double mu[MODEL_N_PARAMETERS], MODEL_result *result, void *work)
{
  double rest[4 + MODEL_N_PARAMETERS] = {0};

  return step(mu, 0, rest, result, work);
}
