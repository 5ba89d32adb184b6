/* The listed times of the history. */
extern const double MODEL_time[MODEL_N_TIMES];

/* What a step leaves for the next: forces and slips of the contacts, inelastic strains. A copy is a point to go back
   to. */
typedef struct {
  double value[MODEL_N_STATES];
} MODEL_state;

/* At rest, before the first step, in which all loads act at once. */
void MODEL_start(MODEL_state *state);
/* Advances the state to time t, after that of the step before, and gives the results there; tables are those of the
   history. mu may differ from step to step: between them it is on a straight line. Steps are those of the library's
   paths, halved where one has no solution; if none is found the state stays. work: MODEL_work_size() bytes, aligned as
   malloc() does, for this call alone; NULL: allocated for the call. Several threads may call it at the same time, each
   with its own state, work and result. */
int MODEL_step(const double mu[MODEL_N_PARAMETERS], double t, MODEL_state *state, MODEL_result *result, void *work);
size_t MODEL_work_size(void);
