/* Results at mu. work: MODEL_work_size() bytes, aligned as malloc() does, for this call alone; NULL: allocated
   for the call. Several threads may call it at the same time, each with its own work and result. */
int MODEL_predict(const double mu[MODEL_N_PARAMETERS], MODEL_result *result, void *work);
size_t MODEL_work_size(void);
