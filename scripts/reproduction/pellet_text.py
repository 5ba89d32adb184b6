"""Section 7: the text of the report; hyco's numbers are filled in from the runs."""

TEXT = """\
# Section 7: the pellet in its cladding

Mesh {mesh}. S1, S2 and S3 are the radii 4.10 (no gap), 4.02 and 4.06, each over 25 load steps. 5 radii: {five};
9 radii: {nine}; that of S3 is in neither set.

Errors are those of S3, in percent: the largest over the RID divided by the largest value there, and of these the maximum
over its {contacts} steps with contact (from step {first} on). *paper* in the column RID is the paper's RID: DEIM points of displacements, stresses and generalised
forces, the top of the pellet, contact nodes within 0.1 mm (without: *no extension*), and one layer (*no layer*).

{numbers}
The RID's share is that of S3's full-order contact force, at the loads 0.6 / 0.8 / 1. The
speed-up is CPU of the ramp at full order, which keeps its factor, over CPU of it predicted ({full_ms} ms per step, {ms} ms
reduced); the paper's 10 is relative to an active set with a new matrix in each iteration.

The accuracy is not monotone in modes, radii or layers, because DEIM's few elements change with each. In the paper the model is half as accurate without
the extension; here the error over a larger RID need not fall.

## Why the paper's 1 % and 5 % cannot come from S1 and S2

S1 has no gap: proportional pressures give multiples of one solution (the second singular value of its 25 snapshots is {second} of the first). S2 is in contact in its
last {touching} of 25 steps; before, its snapshots are multiples of one solution too. Together they span {dimension} dimensions, at 1e-5 {paper_modes} modes of
displacement, stress and force; the paper has 17, 20 and 21 from the same two. S3 is not in that span. The table has the error of its projection on the whole span, and the
smallest maximum error in the RID that any coefficients can reach, for displacement (over the unknowns that the modes describe) and stress (over the cladding's
elements that depend on these alone) separately:

{bounds}
No model with these modes has a displacement error over the RID below {least} % (paper: 1), or a stress error
below {least_sigma} % (paper: 5): the bounds exclude its number for {excluded}. With 9 radii at 1e-10, the same settings give {fine_u} and {fine_sigma} %. Crosses at the bottom mark steps that did not converge:

![errors by step]({folder}/pellet-errors.png)

## Figure 13: contributions to the RID

![figure 13]({folder}/figure-13.png)

9 radii at 1e-10, with {modes} modes of displacement, stress and generalised force. The RID has {rid} of {all_cells} elements ({fraction} %). A separate numpy script makes these
pictures from the snapshots; {outside} of the elements that it finds are outside the RID that hyco chose.

## Figure 14: displacement modes over the cladding

![figure 14]({folder}/figure-14.png)

Component 1 of the first six modes and of the last, each scaled to the value that one node in a hundred exceeds.

## Figures 15 and 16: S3 at full load, reduced model and full order

Displacement 1 over the cladding, and stress 11 over both bodies:

![figure 15]({folder}/figure-15.png)

![figure 16]({folder}/figure-16.png)

Models that converged there: {shown}. The total contact force of S3 at full load is {force} N at full order.
"""
