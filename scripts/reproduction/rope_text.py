"""Section 6: the text of the report; hyco's numbers are filled in from the runs."""

TEXT = """\
# Reproduction of the paper's figures and tables: the rope (section 6)

`scripts/reproduce` writes this page from its runs. Errors are relative, in percent, mean / max over {test_grid} points in the cell centres of the parameter box, unless
stated otherwise. Of the paper's curves and maps, pictures without data, only the shapes can be compared.

## What the paper does not specify

| | here |
| --- | --- |
| which displacements are full order (their number is 5 on the regular grid); every error depends on it | the fewest that give full row rank, selected by the training errors (`rank`: {rank_fe}), and all of A (`all`) |
| signs and ends | the rope hangs down onto an obstacle at height -d(x); with the printed signs there is never contact. The 100 nodes include both ends; the element across x = 0.5 has the average of the two stiffnesses |
| the 10 x 12 snapshots | in the cell centres (`-grid_type centred`): {modes} modes at 1e-7 (paper: 9), {pb14} at 6e-9 (14) |
| norm of the dual POD for the RID | the dual norm of H1: {dual} vector at 1e-1 (paper: 1) |

## The numbers

{numbers}
- **Regular grid.** The RID has the paper's size, {nodes} nodes, {a} of them in A, and contains {covered} % of the contact force on average ({least} % at least).
  More modes, Q-DEIM and a layer give far smaller errors than the paper's with the same 120 solutions.
- **Baselines.** The projection on the dual snapshots themselves (the reduced basis of Haasdonk et al.), {pb_dual_modes} modes with supremizers and
  {pb_dual_vectors} force vectors, is exact at its training points. Nonnegative factorisation has many local minima: read the projection-based rows as ranges.

## Figures 3 to 6: solutions, bases, RID

![figure 3]({folder}/figure-03.png)

![figure 4]({folder}/figure-04.png)

As in the paper, displacements need few vectors and forces many; {slow} iterations help NNMF only for large k.

![figure 5]({folder}/figure-05.png)

![figure 6]({folder}/figure-06.png)

## Figure 7: errors of the regular grid's model

With the paper's settings and all of A full order, then with the accurate settings:

![figure 7]({folder}/figure-07.png)

![figure 7, accurate settings]({folder}/figure-07-fine.png)

## Figures 8 and 9, Table 1: mu = (0.07, 0.17)

![figure 8]({folder}/figure-08.png)

![figure 9]({folder}/figure-09.png)

Ours, and the paper's in brackets; unknowns are the displacements and forces of A; our speed-up, in CPU over the test grid, is over a tridiagonal
solve on 100 nodes, which leaves nothing to gain (the paper's: over a plain active set):

{table_1}
The RID contains {point_covered} % of the force here; the rest is reconstructed (41) from forces that already have errors. The paper's argument for the hybrid model,
smaller errors of the forces at this point than a projection with as many unknowns, 13 against 23, is not found: ours are {at_rid} in the RID, {at_all} everywhere,
against {at_pb14}; over the test points {rid_force} and {all_force} against {pb_force}, in displacement {all_u} against {pb_u}.

## Figure 10: greedy training by the indicator (43)

Mean errors over {history_grid} points, every few iterations up to {iterations}, and the indicator's mean over its training points, of models with the same solutions.

![figure 10]({folder}/figure-10.png)

Mean errors at the end, in percent:

| | displacement, H1 | displacement, 2-norm | forces, dual of H1 | forces, 2-norm |
| --- | --- | --- | --- | --- |
| hybrid, 1e-10 | {u_h1_greedy_paper} | {u_greedy_paper} | {lambda_rid_dual_greedy_paper} | {lambda_rid_greedy_paper} |
| hybrid, 1e-14 and a layer | {u_h1_greedy_fine} | {u_greedy_fine} | {lambda_rid_dual_greedy_fine} | {lambda_rid_greedy_fine} |
| projection-based | {u_h1_pb_on_paper} | {u_pb_on_paper} | {lambda_rid_dual_pb_on_paper} | {lambda_rid_pb_on_paper} |

In the paper the hybrid model is also better in displacement, and equal in the dual norm; ours with the paper's thresholds only in the 2-norm of the forces, with
accurate settings in all four. The indicator's mean at 1e-10 is above the mean error at {above_u} of the {judged} evaluated iterations for the displacement, at
{above_lambda} for the forces; in the paper it overestimates both.

## Figure 11: greedy training by the indicator (45), projection-based

The hybrid models have the same solutions, each with its own RID (in the paper it grows).

![figure 11]({folder}/figure-11.png)

At the end the error of the displacement is {u_greedy_pb} (projection-based) and {u_hr_on_pb} (hybrid), of the forces {lambda_rid_greedy_pb} and {lambda_rid_hr_on_pb};
in the paper the hybrid model is much better in both. The indicator (45) falls with the error, as in the paper. In all histories together, {failed} predictions
did not converge; the means exclude them.

## Figure 12: errors after the greedy training

In the paper the errors are largest where mu1 is small. Our largest error of the displacement is at mu = {worst_fine} with the accurate settings, and at {worst_paper} with the paper's thresholds, which come first:

![figure 12]({folder}/figure-12.png)

![figure 12, accurate settings]({folder}/figure-12-fine.png)
"""
