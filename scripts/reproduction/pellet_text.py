"""Section 7: the text of the report; hyco's numbers are filled in from the runs."""

TEXT = """\
# Section 7: the pellet in its cladding

Mesh {mesh}. S1, S2 and S3 are the radii 4.10 (no gap), 4.02 and 4.06, each over 25 load steps. 5 radii: {five};
9 radii: {nine}; that of S3 is in neither set.

Errors are those of S3, in percent: the largest error over the RID divided by the largest value there, and of these the maximum
over all of its {contacts} steps with contact (from step {first} on). Before contact there are no forces, so that no relative
error is defined. *paper* in the column RID is the paper's RID: DEIM points of displacements, stresses and generalised forces, the top of the
pellet, contact nodes within 0.1 mm, and one layer.

{numbers}
{refusals}The RID's share of the force is that of S3's full-order contact force, at the loads 0.6 / 0.8 / 1: an error over the RID does not include the rest. The
speed-up is the median over the steps, relative to a full order that keeps its factor from step to step ({full_ms} ms per step here, {ms} ms
reduced). Over the whole ramp, including the one factorisation, it is {ramp}. The paper's speed-up of 10 is relative to a plain active set
that solves with a new matrix in each iteration (and so is its 8.5 on the rope).

## Why the paper's 1 % and 5 % cannot come from S1 and S2

- **S1** has no gap: proportional pressures give multiples of one solution. The second singular value of its 25 snapshots is
  {second} of the first, so that there is one mode.
- **S2** is in contact in its last {touching} of 25 steps; before, its snapshots are multiples of one solution too.
- Together they span {dimension} dimensions. At 1e-5 these are {paper_modes} modes of displacement, stress and force; the paper has 17, 20 and 21
  from the same two. Elastic bodies, one ramp and frictionless contact cannot give more.
- S3 is not in that span, whatever the reduced model does. The table has the relative error of its projection on the whole span. For the
  RID it has the smallest maximum error that any coefficients can reach: for the unknowns that the modes describe (those on the contact are
  full order and may be exact), and for the stress of the cladding's elements that depend on these alone. The bounds hold for displacement and
  stress separately, each with the weights that make it largest.

{bounds}
No model with these modes has a displacement error over the RID below {least} %, whereas the paper states 1, or a stress error
below {least_sigma} %, whereas the paper states 5: the bounds exclude its number for {excluded}. The paper's snapshots probably include more than its
text states. With 9 radii at 1e-10, the same settings give {fine_u} and {fine_sigma} %:

![errors by step]({folder}/pellet-errors.png)

Crosses at the bottom mark steps at which the reduced problem did not converge: hyco counts them and writes no numbers for them.

**Without the 0.1 mm extension** (displacement and stress error with it, and without):

{without}
According to the paper, the model is half as accurate without the extension. The extension adds contacts, and therefore a larger share of the force. The error over the RID
need not decrease with it, since the error is taken over another, larger RID.

**Without the layer**:

{layers}
The accuracy is not monotone in modes, radii or layers: DEIM's few elements change with each of them, and so does the share of the contact that
is computed. Use the largest error over all steps, not that of a single step.

## Figure 13: contributions to the RID

![figure 13]({folder}/figure-13.png)

The figure is for 9 radii at 1e-10, with {modes} modes of displacement, stress and generalised force (the paper: 17, 20 and 21); S1 and S2 have too few
points. As in the paper, displacement points lie all over both bodies, and force points lie on the contact, the symmetry planes and
the loaded surfaces. The RID has {rid} of {all_cells} elements ({fraction} %). A separate numpy script makes these pictures from the
snapshots; {outside} of the elements that it finds are outside the RID that hyco chose.

## Figure 14: displacement modes over the cladding

![figure 14]({folder}/figure-14.png)

The figure shows component 1 of the first six modes and of the last, each scaled to the value that one node in a hundred exceeds. As in the paper, later modes have larger gradients.

## Figures 15 and 16: S3 at full load, reduced model and full order

Displacement 1 over the cladding:

![figure 15]({folder}/figure-15.png)

Stress 11 over both bodies:

![figure 16]({folder}/figure-16.png)

Models that converged there: {shown}. The total contact force of S3 at full load is {force} N at full order.
"""
