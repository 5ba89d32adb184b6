/*
  Surfaces of an exported model that move past each other: the master of each slave by the library's search, whose text
  stands before this one, its normal, gap and area, and the rows of the contacts in the axes of the bodies.
*/
/* What a contact has met. n = 0: nothing. */
typedef struct {
  int n, place[WIDE], n_masters;
  PetscInt master[HYCO_FACET_NODES];
  double weight[HYCO_FACET_NODES], normal[3], gap, area, value[WIDE];
} Met;

/* Arrays of a search; X: of the nodes at mu. */
typedef struct {
  double *X, *outward, *area, *normal; /* by node, node, node; by facet of a master */
  HycoPoint *item;
  HycoBox *box;
} Room;

/* n dS: the sum over each facet in normal[], times the functions of its nodes in vector[], its length in area[]. */
static void add_facets(const Surfaces *s, const Surface *of, const double X[], double normal[], double vector[],
                       double area[])
{
  for (PetscInt k = 0; k < of->n * s->nq; k++) {
    const PetscInt f = k / s->nq, q = k % s->nq, *node = s->facet + (of->first + f) * s->nf;
    const double *N = s->N + q * s->nf, *dN = s->dN + 2 * q * s->nf;
    double t[2][3] = {{0, 0, 0}, {0, 0, 1}}, n[3], radius = 0;

    for (PetscInt d = 0; d < s->dim - 1; d++) {
      for (PetscInt c = 0; c < 3; c++) {
        t[d][c] = 0;
        for (PetscInt a = 0; a < s->nf; a++) t[d][c] += X[3 * node[a] + c] * dN[2 * a + d];
      }
    }
    HycoFacetCross((const double(*)[3])t, (double)of->side * s->w[q], n);
    for (PetscInt a = 0; a < s->nf; a++) radius += N[a] * X[3 * node[a]];
    for (PetscInt c = 0; c < 3; c++) {
      if (s->around > 0) n[c] *= s->around * radius;
      if (normal) normal[3 * f + c] += n[c];
      for (PetscInt a = 0; vector && a < s->nf; a++) vector[3 * node[a] + c] += N[a] * n[c];
    }
    for (PetscInt a = 0; area && a < s->nf; a++) area[node[a]] += N[a] * HycoLength(n);
  }
}

/* Adds `scale` times a contact's normal at a node to its row, in the axes of the node's body; prescribed displacements
   go to the gap. Returns 0 if the model does not know the node. */
static int add_node(const Surfaces *s, PetscInt node, double scale, const double value[], Met *met)
{
  const double *Q = s->pose[node] < 0 ? NULL : value + s->pose[node];
  const int *place = s->place + node * s->dim, *given = s->given + node * s->dim;
  double own[3] = {0, 0, 0};

  for (PetscInt c = 0; c < s->dim; c++) {
    const double entry = scale * met->normal[c];

    if (place[c] == PRESCRIBED) {
      met->gap -= given[c] < 0 ? 0 : entry * value[given[c]];
    } else if (fabs(entry) > 1e-14) { /* less is round-off of the normal, as in the library */
      if (place[c] == UNKNOWN) return 0;
      for (PetscInt d = 0; d < s->dim; d++) own[d] += (Q ? Q[3 * c + d] : c == d) * entry;
    }
  }
  for (PetscInt d = 0; d < s->dim; d++) {
    if (own[d] == 0 || place[d] < 0) continue;
    met->place[met->n] = place[d];
    met->value[met->n++] = own[d];
  }
  return 1;
}

/* The contacts of one search. */
static int meet(const Surfaces *s, const Facing *h, const Room *r, const double value[], Met met[])
{
  const Surface *slave = &s->surface[h->slave], *master = &s->surface[h->master];
  const PetscInt *node = s->facet + master->first * s->nf;
  struct _n_HycoPatches patches = {r->X, r->normal, master->n, s->nf, s->nf, node, r->item, r->box, NULL};
  HycoMasterSearch t = {0};

  memset(r->outward, 0, 3 * (size_t)s->n_nodes * sizeof(double));
  memset(r->area, 0, (size_t)s->n_nodes * sizeof(double));
  memset(r->normal, 0, 3 * (size_t)master->n * sizeof(double));
  add_facets(s, slave, r->X, NULL, r->outward, r->area);
  add_facets(s, master, r->X, r->normal, NULL, NULL);
  for (PetscInt i = 0; i < s->n_nodes; i++) HycoNormalise(r->outward + 3 * i);
  for (PetscInt f = 0; f < master->n; f++) HycoNormalise(r->normal + 3 * f);
  HycoPatchesBuild(&patches);
  t.X = r->X;
  t.patches = &patches;
  t.n = master->n;
  t.nf = s->nf;
  t.node = (PetscInt *)node; /* which a search only reads, like the border */
  t.normal = r->normal;
  t.outward = r->outward;
  t.edges = h->edges;
  t.n_border = master->n_border;
  t.border = (PetscInt *)s->border + master->border;
  t.at_border = (PetscBool *)s->at_border + master->at_border;
  for (PetscInt k = h->first; k < h->first + h->n; k++) {
    const PetscInt of = s->slave[k];
    HycoProjection at;
    Met *m = &met[k];

    HycoMasterSearchProject(&t, of, PETSC_FALSE, &at);
    if (at.n && (at.distance > s->reach[h - s->search] ||
                 (HycoMasterSearchIsOutside(&t, of, &at) && HycoMasterSearchOnBorder(&t, &at))))
      at.n = 0;
    m->n = 0;
    m->gap = 0;
    m->area = r->area[of];
    m->n_masters = (int)at.n;
    for (PetscInt c = 0; c < 3; c++) {
      double x = 0;

      m->normal[c] = r->outward[3 * of + c];
      for (PetscInt a = 0; a < at.n; a++) x += at.weight[a] * r->X[3 * at.node[a] + c];
      m->gap += m->normal[c] * (x - r->X[3 * of + c]);
    }
    if (fabs(m->gap) <= s->touches) m->gap = 0;
    if (at.n && !add_node(s, of, 1, value, m)) return 0;
    for (PetscInt a = 0; a < at.n; a++) {
      m->master[a] = at.node[a];
      m->weight[a] = at.weight[a];
      if (!add_node(s, at.node[a], -at.weight[a], value, m)) return 0;
    }
  }
  return 1;
}
