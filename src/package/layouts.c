/* The layout of the public structs, for bindings to other languages. */
#include <hycobindings.h>
#include <hycoimpl.h>
#include <hycoreducer.h>
#include <stddef.h>
#include <string.h>

/* clang-format off */
/* The kind and the size of an item follow from the member's type; an array is a pointer here. */
#define KIND(x)                                                                                                        \
  _Generic((x),                                                                                                        \
      PetscReal: 'f',                                                                                                  \
      PetscReal *: 'f',                                                                                                \
      char *: 'S',                                                                                                     \
      const char *: 'z',                                                                                               \
      const PetscReal *: 'p',                                                                                          \
      const PetscBool *: 'p',                                                                                          \
      const HycoStep *: 'p',                                                                                           \
      default: 'i')
#define ITEM(x) _Generic((x), PetscReal *: sizeof(PetscReal), char *: sizeof(char), default: sizeof(x))
#define FIELD(type, member)                                                                                            \
  {#member, KIND(((type *)0)->member), offsetof(type, member), ITEM(((type *)0)->member),                              \
   sizeof(((type *)0)->member) / (ITEM(((type *)0)->member))}

#define F(member) FIELD(HycoSummary, member)
static const HycoMember summary[] = {
  F(n_dof), F(n_contacts), F(n_active), F(n_still), F(n_dependent), F(iterations), F(dim), F(total_contact_force),
  F(lambda_max), F(lambda_norm2), F(u_norm2), F(u_min), F(u_max), F(u_relative), F(quantity), F(n_facing), F(overlap),
  F(sliding), F(strain_energy), F(external_work), F(gap_work), F(energy_defect), F(kkt.stationarity),
  F(kkt.penetration), F(kkt.adhesion), F(kkt.complementarity), F(kkt.rounding), F(reason), F(seconds.setup),
  F(seconds.assemble), F(seconds.factor), F(seconds.solve), F(seconds.total), F(seconds.cpu), F(loose),
  F(regularised), F(buried), F(why)};
#undef F

#define F(member) FIELD(HycoStep, member)
static const HycoMember step[] = {
  F(index), F(t), F(substeps), F(cuts), F(iterations), F(most_iterations), F(factors), F(active_set_iterations),
  F(linear_iterations), F(most_linear_iterations), F(n_active), F(total_contact_force), F(lambda_max), F(u_norm2),
  F(mises), F(inelastic), F(residual), F(kkt), F(work), F(contact_work), F(stored), F(dissipated), F(thermal),
  F(energy_defect), F(seconds), F(seconds_factor), F(seconds_solve), F(seconds_law), F(sliding),
  F(friction_work), F(n_slipping), F(disproven), F(n_dependent), F(quantity)};
#undef F

#define F(member) FIELD(HycoHistory, member)
static const HycoMember history[] = {
  F(n),           F(step),     F(ended), F(t),       F(why),   F(no_equilibrium), F(newton),
  F(factor_cost), F(n_orders), F(order), F(n_taken), F(taken), F(path_quantity),  F(n_bound), F(time_error)};
#undef F

#define F(member) FIELD(HycoReaction, member)
static const HycoMember reaction[] = {
  F(kind), F(group), F(force), F(moment)};
#undef F

#define F(member) FIELD(HycoContactResult, member)
static const HycoMember contact_result[] = {
  F(name), F(n), F(n_active), F(force), F(moment), F(area), F(pressure), F(friction), F(friction_work),
  F(pressure_min)};
#undef F

#define F(member) FIELD(HycoPrediction, member)
static const HycoMember prediction[] = {
  F(type), F(title), F(n_multipliers), F(n_dof), F(n_contacts), F(n_modes), F(n_fe_dofs), F(n_facing), F(overlap),
  F(sliding), F(n_all_contacts), F(n_active), F(n_rid_active), F(iterations), F(rid_nodes), F(rid_elements), F(dim),
  F(rid_fraction), F(covered_force), F(total_contact_force), F(lambda_max), F(lambda_norm2), F(u_norm2), F(u_min),
  F(u_max), F(quantity), F(condition), F(path_quantity), F(path_force), F(path_mises), F(path_inelastic), F(residual),
  F(contact_residual), F(estimated_error_u), F(estimated_error_sigma), F(estimated_error_lambda),
  F(estimated_error_quantity), F(inconsistency), F(inconsistent), F(balance), F(unbalanced), F(unseen),
  F(unseen_feature), F(beyond), F(gives_forces), F(interpolation_error), F(kkt.stationarity), F(kkt.penetration),
  F(kkt.adhesion), F(kkt.complementarity), F(kkt.rounding), F(method), F(reason), F(seconds.setup),
  F(seconds.assemble), F(seconds.factor), F(seconds.solve), F(seconds.total), F(seconds.cpu), F(n_dependent), F(loose),
  F(why), F(free_motion)};
#undef F

#define F(member) FIELD(HycoGradient, member)
static const HycoMember gradient[] = {
  F(n_outputs), F(n_parameters), F(n_undecided), F(value), F(kink), F(n_times), F(times), F(times_kink), F(path),
  F(path_kink)};
#undef F

#define F(member) FIELD(HycoFit, member)
static const HycoMember fit[] = {
  F(misfit), F(scale), F(converged), F(kink), F(evaluations), F(n_starts), F(n_least), F(n_free), F(n_determined),
  F(method)};
#undef F

#define F(member) FIELD(HycoTraining, member)
static const HycoMember training[] = {
  F(type), F(summary), F(next), F(n_samples), F(n_modes), F(n_dual_modes), F(n_stress_modes),
  F(n_force_modes), F(n_fe_dofs), F(rid_nodes), F(rid_elements), F(rid_contacts), F(rid_fraction), F(error_u),
  F(error_lambda), F(held_out.n), F(n_held), F(seconds_snapshots), F(seconds_reduction)};
#undef F

#define STRUCT(type, fields) {#type, sizeof(type), sizeof(fields) / sizeof((fields)[0]), fields}
/* clang-format on */
static const struct {
  const char *name;
  size_t size;
  PetscInt n;
  const HycoMember *field;
} layouts[] = {
    STRUCT(HycoSummary, summary),
    STRUCT(HycoStep, step),
    STRUCT(HycoHistory, history),
    STRUCT(HycoReaction, reaction),
    STRUCT(HycoContactResult, contact_result),
    STRUCT(HycoPrediction, prediction),
    STRUCT(HycoGradient, gradient),
    STRUCT(HycoFit, fit),
    STRUCT(HycoTraining, training),
    {"PetscInt", sizeof(PetscInt), 0, NULL},
    {"PetscReal", sizeof(PetscReal), 0, NULL},
    {"PetscBool", sizeof(PetscBool), 0, NULL},
    {"MPI_Comm", sizeof(MPI_Comm), 0, NULL},
};

/* Bindings compare these with their own declarations at the start, so that a mismatch of versions is an error and
   not wrong numbers. */
PetscErrorCode HycoGetLayout(const char type[], size_t *size, PetscInt *n, const HycoMember *fields[])
{
  const size_t all = sizeof(layouts) / sizeof(layouts[0]);
  size_t k = 0;

  PetscFunctionBegin;
  HycoCheckGiven(type);
  HycoCheckGiven(size);
  while (k < all && strcmp(layouts[k].name, type)) k++;
  HycoCheck(k < all, "there is no layout of a type %s; HycoSummary, HycoPrediction and others have one", type);
  *size = layouts[k].size;
  if (n) *n = layouts[k].n;
  if (fields) *fields = layouts[k].field;
  PetscFunctionReturn(PETSC_SUCCESS);
}
