"""Section 7: the words of the report; numbers of ours are filled in from the runs."""

TEXT = """\
# Section 7: the pellet in its cladding

Mesh {mesh}. S1, S2 and S3 are the radii 4.10 (no gap), 4.02 and 4.06, each over 25 load steps. 5 radii: {five};
9 radii: {nine}; S3's is never among them.

Errors are those of S3, in percent: the largest error over the RID divided by the largest value there, and of these the largest
over all of its {contacts} steps with contact (from step {first} on). Before contact there are no forces, and nothing
is divided by them. *Recipe* is the paper's RID: DEIM points of displacements, stresses and generalised forces, the top of the
pellet, contact nodes within 0.1 mm, one layer.

{numbers}
{refusals}The RID's share is that of S3's full-order contact force, at the loads 0.6 / 0.8 / 1: an error over the RID says nothing of the rest. The
speed-up is the median over the steps, beside a full order that keeps its factor from step to step ({full_ms} ms a step here, {ms} ms
reduced); over the whole ramp, the one factorisation included, it is {ramp}. The paper's 10 is over a plain active set
that solves with a new matrix in each iteration (and its 8.5 on the rope as well).

## Why the paper's 1 % and 5 % cannot come from S1 and S2

- **S1** has no gap: pressures that grow together give multiples of one solution. Of its 25 snapshots the second singular value is
  {second} of the first: one mode.
- **S2** touches in its last {touching} of 25 steps; before, it gives multiples of one solution too.
- Together they span {dimension} dimensions. At 1e-5 that is {paper_modes} modes of displacement, stress and force; the paper has 17, 20 and 21
  from the same two. Elastic bodies, one ramp and frictionless contact leave no room for more.
- S3 is not in that span, whatever the reduced model does. The table has the relative error of its projection on all of it, and for the
  RID the least largest error that any coefficients leave: on the unknowns that the modes describe (those on the contact are
  full order and may be exact), and on the stress of the cladding's elements made of these alone. The bounds hold for displacement and
  stress each by itself, by whatever weights make them largest.

{bounds}
No model with these modes has a displacement error over the RID below {least} %, where the paper states 1, or a stress error
below {least_sigma} %, where it states 5: the bounds exclude its number for {excluded}. Its snapshots seem to hold more than its
text says. On 9 radii at 1e-10 the same recipe has {fine_u} and {fine_sigma} %:

![errors by step]({folder}/pellet-errors.png)

Crosses at the bottom are steps at which the reduced problem did not converge: hyco counts them and writes no numbers of them.

**Without the 0.1 mm extension** (displacement and stress error with it, and without):

{without}
The paper: half as accurate without. The extension brings contacts, and with them a larger share of the force; an error over the RID
need not fall for it, since it is taken over another RID, which the modes must extend to.

**Without the layer**:

{layers}
Accuracy is not monotone in modes, radii or layers: DEIM's few elements move with each, and so does the share of the contact that
can be computed. Judge by the worst over all steps, never by one.

## Figure 13: contributions to the RID

![figure 13]({folder}/figure-13.png)

For 9 radii at 1e-10, {modes} modes of displacement, stress and generalised force (the paper: 17, 20 and 21); S1 and S2 have too few
points to show. As in the paper: displacement points lie all over both bodies, force points on the contact, the symmetry planes and
the loaded surfaces. The RID has {rid} of {all_cells} elements ({fraction} %). These pictures are made from the
snapshots by numpy; {outside} of the elements found so are outside of the RID that hyco chose.

## Figure 14: displacement modes over the cladding

![figure 14]({folder}/figure-14.png)

The first six and the last, component 1, each scaled to what one node in a hundred exceeds; as in the paper, later modes have larger gradients.

## Figures 15 and 16: S3 at full load, reduced beside full order

Displacement 1 over the cladding:

![figure 15]({folder}/figure-15.png)

Stress 11 over both bodies:

![figure 16]({folder}/figure-16.png)

Models that converged there: {shown}. The total contact force of S3 at full load is {force} N at full order.
"""
