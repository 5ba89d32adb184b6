/* Where bodies are: the similar map nearest to the motion of their nodes (Procrustes). */
#include <hycobodies.h>

/* K ~ integral of B^T C B with B ~ 1/s: the volume's s^3 in 3D, s^2 in 2D (per unit thickness) and s in 1D times
   s^-2; axisymmetric as in 3D, because the radius scales too. */
PetscInt HycoPosePower(HycoFE fe)
{
  return fe->dim == 3 || fe->formulation == HYCO_AXISYMMETRIC ? 1 : fe->dim == 1 ? -1 : 0;
}

/* Sums over nodes of one body: centres, then second moments about them. */
typedef struct {
  PetscReal n, X[3], x[3], XX[9], xX[9], size, off;
} Moments;

/* The orthogonal factor of the linear map A = (sum x X^T) (sum X X^T)^-1, and its mean scale. */
static void FromMoments(PetscInt dim, const Moments *m, HycoPose *pose)
{
  PetscReal A[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, M[9], U[9], Vt[9], work[64], s[3], size = 0;
  PetscBLASInt n, lda = 3, lwork = 64, info, ipiv[3];

  PetscCallVoid(PetscBLASIntCast(dim, &n));
  /* column major, solves (XX) A^T = (xX)^T: rows of A */
  for (PetscInt c = 0; c < 3; c++) {
    for (PetscInt d = 0; d < 3; d++) {
      M[3 * d + c] = m->XX[3 * c + d];
      A[3 * c + d] = c < dim && d < dim ? m->xX[3 * c + d] : c == d;
    }
  }
  LAPACKgesv_(&n, &n, M, &lda, ipiv, A, &lda, &info);
  pose->residual = info ? 1 : 0;
  for (PetscInt k = 0; k < 9; k++) M[k] = A[k];
  /* The polar factor V U^T may be a reflection: mirrored bodies are allowed. */
  LAPACKgesvd_("A", "A", &n, &n, M, &lda, s, U, &lda, Vt, &lda, work, &lwork, &info);
  pose->s = 0;
  for (PetscInt c = 0; c < dim; c++) pose->s += s[c] / dim;
  for (PetscInt k = 0; k < 9; k++) pose->Q[k] = k % 4 == 0;
  /* A has the rows of the map as columns: column major A = (map)^T = U s Vt, map = V s U^T */
  for (PetscInt c = 0; c < dim; c++) {
    for (PetscInt d = 0; d < dim; d++) {
      pose->Q[3 * c + d] = 0;
      for (PetscInt k = 0; k < dim; k++) pose->Q[3 * c + d] += Vt[3 * c + k] * U[3 * k + d];
      /* Exact zeros keep the rows of B of unturned bodies sparse and the same from one mu to the next. */
      if (PetscAbsReal(pose->Q[3 * c + d]) < 1e-15) pose->Q[3 * c + d] = 0;
    }
  }
  for (PetscInt c = 0; c < dim; c++) size = PetscMax(size, PetscAbsReal(s[c] - pose->s));
  pose->residual = PetscMax(pose->residual, size / PetscMax(pose->s, 1e-300));
}

/* Adds the distance of a node from the fitted map. */
static void AddDistance(PetscInt dim, const HycoPose *pose, const PetscReal X[], const PetscReal x[], Moments *m)
{
  for (PetscInt c = 0; c < dim; c++) {
    PetscReal at = m->x[c];

    for (PetscInt d = 0; d < dim; d++) at += pose->s * pose->Q[3 * c + d] * (X[d] - m->X[d]);
    m->off = PetscMax(m->off, PetscAbsReal(at - x[c]));
    m->size = PetscMax(m->size, PetscAbsReal(X[c] - m->X[c]) * pose->s);
  }
}

/* x X^T as well as X X^T: their quotient is the linear map of least squares, before its orthogonal factor is
   taken. */
static void AddSecond(PetscInt dim, const PetscReal X[], const PetscReal x[], Moments *m)
{
  for (PetscInt c = 0; c < dim; c++) {
    for (PetscInt d = 0; d < dim; d++) {
      m->XX[3 * c + d] += (X[c] - m->X[c]) * (X[d] - m->X[d]);
      m->xX[3 * c + d] += (x[c] - m->x[c]) * (X[d] - m->X[d]);
    }
  }
}

/* The local counterpart of HycoBodyPoses(), for the nodes of one cell. */
void HycoPoseFit(PetscInt dim, PetscInt n, const PetscReal X[], const PetscReal x[], HycoPose *pose)
{
  Moments m = {.n = n};

  for (PetscInt i = 0; i < 3 * n; i++) {
    m.X[i % 3] += X[i] / n;
    m.x[i % 3] += x[i] / n;
  }
  /* Second moments about the centres: the best turn does not depend on the translation. */
  for (PetscInt i = 0; i < n; i++) AddSecond(dim, X + 3 * i, x + 3 * i, &m);
  FromMoments(dim, &m, pose);
  for (PetscInt i = 0; i < n; i++) AddDistance(dim, pose, X + 3 * i, x + 3 * i, &m);
  /* The largest distance of a node from the fitted map, relative to the body: above round-off the map changes the
     shape. */
  if (m.size > 0) pose->residual = PetscMax(pose->residual, m.off / m.size);
}

/* Three passes because second moments need the centres, and distances the map. Each pass reduces over ranks, so that
   every rank makes the same pose from the same sums; a node counts once, on its owner. The pose is the orthogonal
   factor and the mean scale of the affine map that fits the mapped nodes best by least squares; its residual tells how
   far the map is from turning and scaling. */
PetscErrorCode HycoBodyPoses(HycoFOM f, PetscInt n, const PetscInt of[], const PetscReal X0[], HycoPose pose[])
{
  const PetscInt dim = f->fe->dim, width = (PetscInt)(sizeof(Moments) / sizeof(PetscReal));
  const PetscReal *x = f->fe->X;
  Moments *m;

  PetscFunctionBegin;
  PetscCall(PetscCalloc1(n, &m));
  for (int pass = 0; pass < 3; pass++) {
    for (PetscInt i = 0; i < f->part->n_nodes; i++) {
      Moments *own = &m[of[i]];

      /* Nodes of the overlap are on several ranks. */
      if (HycoMeshOwned(f->part, i) < 0) continue;
      own->n += pass == 0;
      for (PetscInt c = 0; pass == 0 && c < 3; c++) {
        own->X[c] += X0[3 * i + c];
        own->x[c] += x[3 * i + c];
      }
      if (pass == 1) AddSecond(dim, X0 + 3 * i, x + 3 * i, own);
      if (pass == 2) AddDistance(dim, &pose[of[i]], X0 + 3 * i, x + 3 * i, own);
    }
    if (pass == 1) { /* the centres are the same on all ranks */
      for (PetscInt b = 0; b < n; b++) HycoAllreduce(m[b].XX, 18, MPIU_REAL, MPI_SUM, HycoComm(f));
      /* One reduction for all bodies; distances are maxima, sums otherwise. */
    } else
      HycoAllreduce(&m[0].n, n * width, MPIU_REAL, pass ? MPI_MAX : MPI_SUM, HycoComm(f));
    for (PetscInt b = 0; b < n; b++) {
      for (PetscInt c = 0; pass == 0 && c < 3; c++) {
        m[b].X[c] /= m[b].n;
        m[b].x[c] /= m[b].n;
      }
      if (pass == 1) FromMoments(dim, &m[b], &pose[b]);
      if (pass == 2 && m[b].size > 0) pose[b].residual = PetscMax(pose[b].residual, m[b].off / m[b].size);
    }
  }
  PetscCall(PetscFree(m));
  PetscFunctionReturn(PETSC_SUCCESS);
}
