"""User errors: one clear line on stderr, a status that is not 0, soon, and no file left."""
import glob
import os
import resource
import shlex
import shutil
import subprocess
import time
import unittest

from common import HYCO, MPIRUN, PATIENCE, PELLET, ROPE, Case, said, settled
from rows import Rows

R = ['-scene', ROPE, '-mu', '0.07,0.17']
P = ['-scene', PELLET, '-mu', '4.06,1']
T = ['-scene', ROPE, '-model', 'out.h5']
N = ['-grid', '2,2']
STOPPED = ['-hyco_solver_max_its', '1', '-hyco_solver_fallback', 'false']
ROWS = Rows('faults')
OUT = ['-output', 'out.xdmf', '-report', 'out.json']

# (arguments, expected text); solve writes its output and report, train its model: none of it may be left
CASES = [
    # the command line
    (['slve', *R], 'there is no command "slve"'),
    ([], 'give a command: check, solve, train, predict, compare, fit, export or view'),
    (['solve', *R, '-hyco_solver_typ', 'tao'], 'has no option -hyco_solver_typ; did you mean -hyco_solver_type?'),
    (['solve', *R, '-zzz', '1'], 'has no option -zzz'),
    (['solve', *R, '-model', 'm.h5'], 'hyco solve has no option -model'),
    (['predict', '-model', 'rope.h5', '-scene', ROPE, '-mu', '0.07,0.17'], 'hyco predict uses -scene only with -hyco_fallback'),
    (['solve', *R, 'stray'], '"stray" is not an option'),
    (['solve', *R, '-o', 'x.xdmf'], 'has no option -o; did you mean -output?'),
    (['train', *T, '-mu', '0.1,0.1'], 'hyco train has no option -mu; these commands have it: hyco solve, predict, compare'),
    (['solve', '-scene', ROPE], 'the scene has 2 parameters (mu1 from 0.05 to 0.25, mu2 from -0.05 to 0.5); give -mu'),
    (['solve', *R, '-options_file', 'none.opt'], 'PETSc cannot be initialised: '),
    (['solve', *R, '-options_file', 'text.h5'], 'PETSc cannot be initialised: '),
    (['solve', *R, '-options_file', 'itself.opt'], 'itself.opt names itself'),
    (['solve', *R, '-options_file', 'round.opt'], 'round.opt names itself, or files name each other'),
    (['solve', *R, '-options_file_yaml', 'broken.yaml'], 'the option file broken.yaml is not valid YAML: line 3: '),
    (['solve', *R, '-options_file', 'unknown.opt'], 'the option -hyco_solver_typ has no effect'),
    (['solve', *R, '-options_file', 'wrong.opt'], '-hyco_solver_type is "newton"; it must be one of'),
    (['solve', *R, '-options_file', 'stray.opt'], 'stray.opt line 2: stray'),
    (['solve', '-mu', '0.07,0.17'], '-scene is missing'),
    (['solve', *R, '-output'], '-output needs a value'),
    (['train', '-scene', ROPE, *N], '-model is missing'),
    (['solve', *R, '-hyco_solver_type', 'newton'], 'it must be one of: active_set, tao, lemke'),
    (['solve', *R, '-hyco_solver_rtol', '2'], '-hyco_solver_rtol is "2"; it must be a number from'),
    (['solve', *R, '-hyco_solver_max_its', '1.5'], 'it must be a whole number'),
    (['solve', *R, '-hyco_solver_rtol', '1' * 2000], '-hyco_solver_rtol is longer than'),
    (['solve', *R, '-hyco_solver_type', 'tao', '-hyco_tao_type', 'foo'], '-hyco_tao_type is "foo"; it must be one of: gpcg'),
    (['solve', *R, '-hyco_tao_gatl', '1e-9'], 'the option -hyco_tao_gatl has no effect'),
    (['solve', *P, '-hyco_mumps_icntl14', 'lu'], 'the option -hyco_mumps_icntl14 has no effect'),
    # options that exclude each other
    (['solve', *P, '-hyco_linear', 'iterative', '-hyco_solver_form', 'dual'], '-hyco_linear iterative works with the forms primal'),
    (['solve', *P, '-hyco_linear', 'iterative', '-hyco_solver_type', 'lemke'], '-hyco_linear iterative needs a symmetric system, the types active_set'),
    (['solve', *R, '-hyco_solver_type', 'lemke', '-hyco_solver_form', 'primal'], 'lemke needs the matrix of the dual form'),
    (['solve', *R, '-hyco_solver_form', 'dual_free'], 'active_set needs the matrix of the dual form'),
    (['solve', *R, '-hyco_solver_type', 'tao', '-hyco_tao_type', 'bqpip', '-hyco_solver_form', 'dual_free'], "TAO's bqpip reads the matrix"),
    (['solve', *R, '-hyco_solver_type', 'tao', '-hyco_tao_type', 'ssils', '-hyco_solver_form', 'primal'], "TAO's ssils needs the matrix"),
    (['train', *T, *N, '-hyco_pod_tol', '1'], '-hyco_pod_tol 1 leaves no mode; give a smaller value'),
    (['train', *T, '-grid', '4,4', '-grid_type', 'centred', '-hyco_pod_tol', '1e-16', '-hyco_hybrid', 'all', '-hyco_hybrid_ridge', '0', '-hyco_rid_layers', '0',
      '-hyco_rid_modes', 'dual'], '-hyco_hybrid_ridge 0: the 16 modes are not linearly independent on the 1 unknowns of A'),
    (['train', *T, '-grid', '3,9', '-grid_type', 'centred', '-hyco_model_type', 'projection', '-hyco_pod_tol', '0.5', '-contact_ground_gap', '10', '-force_rope_x',
      '-(mu2 > 0.3 ? sin(pi*x) : mu2 > 0.1 ? sin(2*pi*x) : sin(3*pi*x))'], 'the projection-based model misses its own training displacements by 68 %'),
    (['solve', *R, *N, '-table', 'out.csv'], 'the option -mu has no effect'),
    (['predict', '-model', 'rope.h5', *N, '-table', 'out.csv', '-output', 'out.xdmf', '-hyco_fallback', '-scene', ROPE, '-target_u', '1e-2'],
     'works without -hyco_fallback only'),
    (['solve', *R, '-hyco_solver_type', 'active_set', '-hyco_tao_type', 'gpcg'], '-hyco_tao_type has no effect here, because the solver type is active_set'),
    (['train', *T, *N, '-validation_grid', '2,2', '-validation_points', 'p.csv', '-target_u', '1e-2'], 'there are two sets of held-out points'),
    (['train', *T, *N, '-validation_grid', '2,2', '-grid_type', 'centred'], 'is also a training point'),
    (['train', *T, '-greedy', '-training_grid', '3,3', '-target_u', '1e-2'], 'for train -greedy use -target'),
    (['train', *T, *N, '-hyco_model_type', 'condensed'], '"condensed"; it must be one of: bodies'),
    (['train', *T, *N, '-hyco_dual', 'nnmf'], '-hyco_dual nnmf is for -hyco_model_type projection'),
    (['train', *T, *N, '-hyco_dual', 'fe', '-hyco_model_type', 'projection'], '-hyco_dual fe leaves a projection-based model'),
    (['train', *T, *N, '-hyco_hybrid', 'contact'], '-hyco_hybrid contact leaves no equation for the modes'),
    (['predict', '-model', 'rope.h5', '-mu', '0.07,0.17', '-target_u', '1e-2'], 'give -hyco_fallback too'),
    (['predict', '-model', 'rope.h5', '-mu', '0.07,0.17', '-hyco_fallback'], 'give its -scene too'),
    (['view', '-scene', ROPE, '-model', 'rope.h5'], 'give -model FILE.h5 or -scene FOLDER'),
    (['view'], 'give -model FILE.h5 or -scene FOLDER'),
    # the scene
    (['solve', '-scene', 'nowhere', '-mu', '1'], 'the scene nowhere does not exist'),
    (['solve', '-scene', 'empty', '-mu', '1'], 'the folder empty has no scene.yaml'),
    (['solve', '-scene', 'broken.yaml', '-mu', '1'], 'broken.yaml is not valid YAML for hyco: line 3: '),
    (['solve', '-scene', 'deep.yaml', '-mu', '1'], 'deep.yaml is not valid YAML for hyco: line 2: brackets and entries are nested deeper than 64 levels'),
    (['solve', *R, '-body_rope_young', 101 * '(' + '1' + 101 * ')'], 'has 101 brackets inside each other; at most 100 are possible'),
    (['solve', *R, '-body_rope_yung', '3'], "the scene's entry body_rope_yung is unknown"),
    (['solve', *R, '-body_rope_yung', '3'], 'did you mean young?'),
    (['solve', *R, '-fixed_end_x', '0'], 'the mesh has no group "end"; its groups are: ends, rope; did you mean ends?'),
    (['solve', *R, '-body_string_young', '1'], 'body "string" has no cells'),
    (['solve', *R, '-fixed_ends_y', '0'], 'no component y'),
    (['solve', *R, '-body_rope_young', '2*(x'], 'body_rope_young: "2*(x" is not an expression'),
    (['solve', *R, '-body_rope_young', '2*foo'], 'uses foo, which is unknown; the known names are x, y, z, mu1, mu2, pi'),
    (['solve', *R, '-contact_ground_gap', '1/0'], 'contact_ground_gap: "1/0" is not finite'),
    (['solve', *R, '-body_rope_young', '1/(x-x)'], 'is not finite'),
    (['solve', *R, '-body_rope_young', '-3'], "Young's modulus must be positive"),
    (['solve', *P, '-body_pellet_young', 'x-4'], "Young's modulus must be positive"),
    (['solve', *P, '-body_pellet_poisson', '0.5'], "Poisson's ratio must lie between -1 and 0.5"),
    (['solve', *R, '-contact_ground_type', 'wall'], 'it must be mortar, obstacle, pair, rigid or surface'),
    # parameters
    (['solve', '-scene', ROPE, '-mu', '0.04,0.17'], 'mu1 = 0.04 lies outside its range [0.05, 0.25]'),
    (['solve', '-scene', ROPE, '-mu', '0.07'], '-mu has 1 values; the scene has 2 parameters: mu1,mu2'),
    (['solve', '-scene', ROPE, '-mu', '0.07,0.17,1'], '-mu has 3 values; the scene has 2 parameters'),
    (['solve', '-scene', ROPE, '-mu', '0.07,a'], 'numbers separated by commas are expected'),
    (['solve', '-scene', ROPE, '-mu', 'nan,0.1'], '-mu is "nan,0.1"'),
    (['solve', '-scene', ROPE, '-mu_mu1', '0.07'], 'give -mu with all of them, or -mu_NAME for each'),
    (['solve', *R, '-mu_mu3', '1'], '-mu_mu3 does not name a parameter'),
    (['solve', *R, '-mu_mu1', '0.07'], '-mu gives every parameter, and -mu_mu1 gives one of them again'),
    (['solve', '-scene', ROPE, '-mu_mu1', '0.08,0.09', '-mu_mu2', '0.17'], '-mu_mu1 has 2 values; one is expected'),
    (['solve', '-scene', ROPE, '-mu', ','.join(['0.1'] * 2000)], '-mu is longer than'),
    # the mesh
    (['solve', *R, '-scene_mesh', 'none.msh'], 'the mesh none.msh cannot be opened'),
    (['solve', *R, '-scene_mesh', 'text.msh'], 'text.msh is not a gmsh mesh'),
    (['solve', *R, '-scene_mesh', 'job.txt'], 'a file of Abaqus, not of gmsh; convert it by scripts/convert job.txt NEW.msh'),
    (['solve', *R, '-scene_mesh', 'ideas.txt'], 'a file of I-DEAS (.unv), not of gmsh; convert it by scripts/convert ideas.txt'),
    (['solve', *R, '-scene_mesh', 'text.med'], 'a file of MED, not of gmsh; convert it by scripts/convert text.med'),
    (['solve', *R, '-scene_mesh', 'one.msh'], "one.msh has gmsh's format 1; hyco reads 2.2 and 4.1: convert it by gmsh -save"),
    (['solve', *P, '-scene_mesh', 'cut.msh'], 'the mesh cut.msh is damaged'),
    (['solve', *R, '-scene_mesh', os.path.join(PELLET, 'A.msh')], 'body "rope" has no cells'),
    (['solve', *P, '-contact_gap_master', 'clad_outer_low'], 'no node of contact_pellet faces clad_outer_low'),
    (['solve', *P, '-contact_gap_master', 'contact_pellet'], 'the two surfaces must not share nodes'),
    (['solve', *P, '-scene_mesh', 'shifted.msh', '-contact_gap_tolerance', '1e-12'], 'have no node of contact_clad'),
    # outputs
    (['solve', *R, '-output', 'rope.vtk'], 'give a name that ends in .xdmf'),
    (['solve', *R, *STOPPED, '-output', 'rope.vtk'], 'give a name that ends in .xdmf'),  # before it stops
    (['solve', *R, *STOPPED, '-report', 'none/r.json'], 'none/r.json cannot be written'),
    (['solve', *R, *STOPPED, '-output', 'rope.xdmf'], 'rope.h5 is a model or a snapshot'),
    (['solve', *R, *STOPPED], 'nothing was written'),
    (['solve', *R, '-report', 'empty'], '-report empty is a folder'),
    (['solve', '-scene', ROPE, *N, '-table', 'x', '-report', 'x'], '-report and -table are the same file, x'),
    (['predict', '-model', 'rope.h5', '-mu', '0.07,0.17', '-report', 'rope.h5'], '-model and -report are the same file, rope.h5'),
    (['predict', '-model', 'rope.h5', *N, '-table', 'none/t.csv'], 'none/t.csv cannot be written'),
    (['solve', *R, '-output', 'none/rope.xdmf'], '-output none/rope.xdmf cannot be written'),
    (['solve', *R, '-report', 'none/r.json'], '-report none/r.json cannot be written'),
    (['solve', '-scene', ROPE, *N, '-output', 'none/r.xdmf', '-table', 'none/t.csv'], '-table none/t.csv cannot be written'),
    # models
    (['predict', '-model', 'none.h5', '-mu', '0.07,0.17'], 'none.h5 cannot be opened'),
    (['predict', '-model', 'cut.h5', '-mu', '0.07,0.17'], 'cut.h5 is not an HDF5 file, or it is damaged; if it was a model, train it again'),
    (['predict', '-model', 'text.h5', '-mu', '0.07,0.17'], 'text.h5 is not an HDF5 file, or it is damaged'),
    (['predict', '-model', 'fields.h5', '-mu', '0.07,0.17'], 'fields.h5'),
    (['predict', '-model', 'rope.h5', '-mu', '0.07'], '-mu has 1 values'),
    (['predict', '-model', 'rope.h5', '-mu', '0.7,0.1'], 'mu1 = 0.7 lies outside its range'),
    (['train', '-scene', ROPE, '-grid', '3,3', '-model', 'o.h5', '-hyco_model_type', 'hybrid', '-hyco_bodies_tol', '1e-5'],
     '-hyco_bodies_tol has no effect here: it is for -hyco_model_type bodies, and the model is hybrid'),
    (['train', '-scene', ROPE, '-grid', '3,3', '-model', 'o.h5', '-hyco_nnmf_vectors', '3'], 'it is for -hyco_model_type projection'),
    (['train', '-scene', ROPE, '-grid', '3,3', '-model', 'o.h5', '-hyco_greedy_keep', 'true'], 'has no effect without -greedy'),
    (['train', '-scene', ROPE, '-grid', '3,3', '-model', 'o.h5', '-hyco_model_type', 'projection', '-hyco_rid_layers', '1'],
     '-hyco_rid_layers has no effect here: it is for -hyco_model_type hybrid or regression, and the model is projection'),
    (['train', '-scene', ROPE, '-grid', '3,3', '-model', 'o.h5', '-hyco_model_type', 'bodies', '-hyco_hybrid', 'all'],
     '-hyco_hybrid has no effect here: it is for -hyco_model_type hybrid or cubature, and'),
    (['train', *T, *N, '-hyco_fallback'], 'hyco train does not use -hyco_fallback; these commands do: hyco predict'),
    (['solve', *R, '-hyco_fallback'], 'hyco solve does not use -hyco_fallback'),
    (['solve', *R, '-hyco_reconstruct', 'false'], 'these commands do: hyco train, predict, compare'),
    (['predict', '-model', 'rope.h5', '-mu', '0.07,0.1', '-output', 'out.vtk'], 'ends in .xdmf'),
    (['compare', '-scene', ROPE, '-model', 'rope.h5'], 'give the test points: -mu V,V,... for one, or -grid'),
    (['compare', '-scene', ROPE, '-model', 'rope.h5', *N, *STOPPED], 'the full-order solution at mu1 = 0.1, mu2 = '),
    (['predict', '-model', 'rope.h5', '-mu', '0.07,0.17', '-output', 'out.xdmf', *STOPPED], 'or a cycle (KKT residuals: '),
    (['predict', '-model', 'rope.h5', *N, *STOPPED], 'converged of a table (-table FILE.csv) says which'),
    (['predict', '-model', 'rope.h5', '-mu', '0.07,0.1', '-output', 'none/out.xdmf'], '-output none/out.xdmf cannot be written'),
    (['predict', '-model', 'empty', '-mu', '0.07,0.1'], 'empty is not a file; give a file that hyco has written'),
    (['compare', '-scene', PELLET, '-model', 'rope.h5', *N], 'was trained on another scene or mesh'),
    (['view', '-model', 'text.h5'], 'text.h5 is not an HDF5 file'),
    # training
    (['train', *T], 'give the training points: -grid N,N,...'),
    (['train', *T, '-greedy'], 'a greedy training needs candidate points'),
    (['train', *T, '-greedy', '-training_grid', '3,3', '-target', '0'], '-target is 0'),
    (['train', *T, '-grid', '20000,20000'], 'the set has more than 100 million points'),
    (['train', *T, '-points', 'header.csv'], 'header.csv contains no point'),
    (['train', *T, '-points', 'semicolon.csv'], 'semicolon.csv, line 2: 2 numbers separated by commas'),
    (['train', *T, '-points', 'outside.csv'], 'mu1 = 0.3 lies outside its range'),
    (['train', *T, '-points', 'other.csv'], 'the column "mu3" is not a parameter'),
    (['train', *T, '-points', 'twice.csv'], 'the column mu1 occurs twice'),
    (['train', *T, '-points', 'p.csv', '-target_u', '1e-2'], '-hyco_validation is 0'),
    (['train', *T, *N, '-scene_mesh', 'none.msh'], 'the mesh none.msh cannot be opened'),
    (['train', '-scene', PELLET, '-model', 'out.h5', '-grid', '1,1', '-contact_gap_master', 'clad_outer_low'],
     'no node of contact_pellet faces clad_outer_low'),
    (['train', *T, *N, '-body_rope_young', 'sqrt((mu1-0.18)^2-0.0001)+x'], 'y = 0, z = 0, mu1 = 0.1'),  # between the points, met by the second of two ranks
    (['train', *T, *N, '-scene_mesh', 'fine.msh', '-hyco_model_type', 'bodies'], 'limited to 3000'),
    (['train', '-scene', 'none.yaml', '-model', 'out.h5', '-greedy', '-training_grid', '3'], '-training_grid has 1 numbers; the scene has 0 parameters'),
    (['train', '-scene', 'nine.yaml', '-model', 'out.h5', '-greedy', '-training_grid', '2' + ',2' * 8], 'the parameters\' ranges have 2^9 corners'),
    (['train', *T, *N, '-hyco_trust_folds', '1'], 'it is now -hyco_validation'),
    (['train', *T, *N, '-hyco_snapshots', 's' * 4050], "the snapshot folder's name is too long"),
    (['train', *T, '-grid', '10'], '-grid has 1 numbers; the scene has 2 parameters'),
    (['train', *T, '-grid', '2,2,2'], '-grid has 3 numbers'),
    (['train', *T, '-grid', '2,0'], 'whole numbers, at least 1, are expected'),
    (['train', *T, '-grid', '2,1', '-grid_type', 'closed'], 'at least 2 are needed'),
    (['train', *T, '-values_mu1', '0.1'], '-values_mu2 is missing'),
    (['train', *T, '-points', 'none.csv'], 'none.csv cannot be opened'),
    (['train', *T, '-points', 'header.csv'], 'header.csv contains no point; a header'),
    (['predict', '-model', 'rope.h5', '-points', os.devnull], '/dev/null contains no point; a header'),
    (['train', *T, *N, '-points', 'p.csv'], 'there are several sets of points'),
    (['train', *T, *N, '-scatter', '3'], 'there are several sets of points'),
    (['train', *T, '-scatter', '2.5'], 'one whole number, at least 1, is expected'),
    (['train', '-scene', ROPE, '-model', 'none/out.h5', *N], 'none/out.h5 cannot be written'),
    (['train', *T, *N, '-hyco_rid_modes', 'foo'], '-hyco_rid_modes has "foo"'),
    (['train', *T, *N, '-hyco_rid_groups', 'foo'], 'the mesh has no group "foo"'),
    (['train', *T, *N, '-hyco_rid_region', 'foo'], 'uses foo, which is unknown'),
    (['train', *T, *N, '-hyco_hybrid', 'foo'], 'it must be one of: auto, rank, contact, all'),
    (['train', *T, *N, '-hyco_deim_type', 'foo'], 'it must be one of: deim, qdeim'),
    (['train', *T, *N, '-hyco_scan', '-3'], '-hyco_scan is "-3"'),
    (['train', *T, *N, '-hyco_hybrid_ridge', '2'], '-hyco_hybrid_ridge is "2"'),
    (['predict', '-model', 'rope.h5', '-mu', '0.1,0.1', '-hyco_reconstruct_solver', 'foo'],
     'it must be one of: auto, nnls, tao'),
    (['predict', '-model', 'rope.h5', '-mu', '0.1,0.1', '-hyco_scan', '5'], 'does not use -hyco_scan'),
    (['predict', '-model', 'rope.h5', '-mu', '0.1,0.1', '-hyco_linear', 'iterative'], '-hyco_linear has no effect here: it is for full order'),
    (['predict', '-model', 'rope.h5', '-mu', '0.1,0.1', '-hyco_solver_form', 'dual'], '-hyco_solver_form has no effect here: it is for full order'),
    (['predict', '-model', 'rope.h5', '-mu', '0.1,0.1', '-hyco_newton', 'elastic'], '-hyco_newton has no effect here: it is for scenes with a history'),
    (['view', '-scene', ROPE, '-hyco_newton', 'elastic'], 'hyco view does not use -hyco_newton; these commands do: hyco check, solve, train, predict, compare'),
    (['view', '-model', 'rope.h5', '-hyco_solver_rtol', '1e-3'], 'hyco view does not use -hyco_solver_rtol'),
    (['solve', *R, '-hyco_groups', '1'], 'hyco solve does not use -hyco_groups; these commands do: hyco train'),
    (['compare', '-scene', ROPE, '-model', 'rope.h5', *N, '-hyco_fallback'], 'hyco compare does not use -hyco_fallback; these commands do: hyco predict'),
    (['train', *T, *N, '-hyco_pod_tol', 'abc'], '-hyco_pod_tol is "abc"'),
    (['train', *T, *N, '-hyco_groups', '9'], '-hyco_groups is 9 on'),
    (['train', *T, *N, '-force_rope_x', '0'], 'so that there are no modes'),
]
# on two ranks: errors found by one rank, by all, or while files are written
TWO = ('itself.opt', 'body_rope_young: "2*(x"', 'text.h5 is not an HDF5 file', 'must be positive', 'none.msh cannot', 'mu1 = 0.04', 'cut.h5', 'contact_clad', 'not valid YAML',
       'has no option -zzz', 'none/out.h5', '-hyco_rid_region', '-hyco_rid_groups', 'none/r.json', 'there are no modes', 'leaves no equation for the modes', 'faces clad_outer_low', 'z = 0, mu1 = 0.1', 'KKT residuals')
# rank 0 runs $1 ... unchanged; the others in the folder $OTHER_FOLDER, with $OTHER_ARGUMENTS appended
APART = '''if [ "${OMPI_COMM_WORLD_RANK:-${PMIX_RANK:-${PMI_RANK:-0}}}" -gt 0 ]; then
  cd "$OTHER_FOLDER"
  eval "set -- \\"\\$@\\" $OTHER_ARGUMENTS"
fi
exec "$@"'''


class Faults(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.hyco('train', '-scene', ROPE, '-grid', '4,4', '-model', 'rope.h5')
        cls.hyco('solve', *R, '-output', 'fields.xdmf')
        os.mkdir(cls.path('empty'))
        for name, text in (('broken.yaml', 'scene:\n  mesh: [a\nbody: {x\n'), ('text.msh', 'hello\n'), ('text.med', 'hello\n'),
                           ('job.txt', '** CAE\n*NODE\n1, 0., 0.\n'), ('ideas.txt', '    -1\n  2411\n'), ('one.msh', '$NOD\n1\n1 0 0 0\n$ENDNOD\n'),
                           ('deep.yaml', 'scene:\n  title: ' + 200000 * '[' + '\n'), ('itself.opt', '# again\n-options_file itself.opt\n'),
                           ('round.opt', '-hyco_linear auto -options_file trip.opt\n'), ('trip.opt', '-options_file round.opt\n'),
                           ('text.h5', 'hello\n'), ('p.csv', 'mu1,mu2\n0.1,0.1\n'), ('header.csv', 'mu1,mu2\n'),
                           ('semicolon.csv', 'mu1,mu2\n0.1;0.2\n'), ('outside.csv', 'mu1,mu2\n0.1,0.2\n0.3,0.2\n'),
                           ('other.csv', 'mu1,mu3\n0.1,0.2\n'), ('twice.csv', 'mu1,mu1\n0.1,0.2\n'),
                           ('unknown.opt', '-hyco_solver_typ tao\n'), ('wrong.opt', '-hyco_solver_type newton\n'),
                           ('stray.opt', '-mu 0.07,0.17\nstray words\n')):
            with open(cls.path(name), 'w', encoding='ascii') as f:
                f.write(text)
        for name, n in (('fine.msh', 4200), ('fewer.msh', 4000)):
            cls.rope_mesh(name, n)
        for name, parameters in (('none.yaml', []), ('nine.yaml', [f'p{k}' for k in range(9)])):
            with open(cls.path(name), 'w', encoding='ascii') as f:
                f.write(f'scene: {{mesh: {os.path.join(ROPE, "rope.msh")}, parameters: [{", ".join(parameters)}]}}\n')
                f.writelines(f'parameter_{p}: {{range: [1, 2]}}\n' for p in parameters)
                f.write(f'body: {{rope: {{young: {"+".join(["1", *parameters])}}}}}\nfixed: {{ends: {{x: 0}}}}\nforce: {{rope: {{x: -1}}}}\n'
                        'contact: {ground: {type: obstacle, group: rope, normal: {x: -1}, gap: 0.1}}\n')
        for source, name, size in ((cls.path('rope.h5'), 'cut.h5', 9000), (os.path.join(PELLET, 'A.msh'), 'cut.msh',
                                                                           60000)):
            with open(source, 'rb') as f, open(cls.path(name), 'wb') as g:
                g.write(f.read(size))
        cls.shift()
        os.mkdir(cls.path('elsewhere'))

    @classmethod
    def shift(cls):
        """Mesh A with the nodes of the cladding raised by 1e-6."""
        with open(os.path.join(PELLET, 'A.msh'), encoding='ascii') as f:
            lines = f.read().split('\n')
        start, end = lines.index('$Nodes'), lines.index('$EndNodes')
        for k in range(start + 2, end):
            x = lines[k].split()
            if len(x) == 3 and float(x[0])**2 + float(x[1])**2 > 4.2**2:
                lines[k] = f'{x[0]} {x[1]} {float(x[2]) + 1e-6!r}'
        # where the two surfaces coincide, the second of two nodes in the same place
        seen = {}
        for k in range(start + 2, end):
            x = lines[k].split()
            if len(x) == 3 and abs(float(x[0])**2 + float(x[1])**2 - 4.1**2) < 1e-6:
                key = tuple(round(float(c), 7) for c in x)
                if key in seen:
                    lines[k] = f'{x[0]} {x[1]} {float(x[2]) + 1e-6!r}'
                seen[key] = k
        with open(cls.path('shifted.msh'), 'w', encoding='ascii') as f:
            f.write('\n'.join(lines))

    def check(self, args, text, ranks):
        names = set(os.listdir(self.folder))
        if args and args[0] in ('solve', 'slve') and '-table' not in args:
            args = args + [a for k in (0, 2) if OUT[k] not in args for a in OUT[k:k + 2]]
        begin = time.monotonic()
        run = self.run_raw(*args, ranks=ranks, timeout=20)
        self.assertLess(time.monotonic() - begin, 20 * PATIENCE)
        self.assertNotEqual(run.returncode, 0, run.stdout)
        lines = said(run)
        self.assertEqual(len(lines), 1, f'one line is expected:\n{run.stderr}')
        self.assertTrue(lines[0].startswith('hyco: error: '), lines[0])
        self.assertIn(text, lines[0])
        self.assertNotIn('internal error', lines[0])
        left = set(os.listdir(self.folder)) - names
        left |= set(glob.glob(self.path('**', '*.partial'), recursive=True))
        shutil.rmtree(self.path('out.h5.snapshots'), ignore_errors=True)
        for name in ('out.xdmf', 'out.h5', 'out.json'):
            if os.path.exists(self.path(name)):
                os.remove(self.path(name))
        left -= {'out.h5.snapshots'}  # kept for the next attempt
        self.assertEqual(left, set())

    def test_one_process(self):
        """Wrong commands, options, values and files on one process."""
        for args, text in CASES:
            with self.subTest(args=' '.join(args), text=text):
                self.check(list(args), text, 0)

    def test_two_ranks(self):
        """Some of the wrong commands, options and files on two ranks: still one line."""
        for args, text in CASES:
            if any(part in text or part in args for part in TWO):
                with self.subTest(args=' '.join(args), text=text, ranks=2):
                    self.check(list(args), text, 2)
        ROWS.add(f'wrong commands, options, values, meshes, files ({len(CASES)}), some on 2 ranks', 'one line, status not 0, nothing left')

    def test_one_point_of_a_set(self):
        """A point where the stiffness has no value, on one rank: the others have predicted theirs, and do not wait."""
        self.hyco('train', '-scene', ROPE, *N, '-body_rope_young', 'sqrt(0.3-mu1)+x', '-model', 'half.h5')
        for values in ('0.05,0.1,0.35', '0.35,0.05,0.1', '0.05,0.35,0.1'):
            for ranks in (2, 3):
                with self.subTest(values=values, ranks=ranks):
                    self.check(['predict', '-model', 'half.h5', '-extrapolate', '-values_mu1', values, '-values_mu2', '0.1',
                                '-table', 'out.csv'], '"sqrt(0.3-mu1)+x" is not finite at', ranks)
        ROWS.add('a point of a set at which the scene has no value, on one rank (3), on 2 and 3 ranks', 'one line, status 1, no rank left waiting')

    def test_stack(self):
        """A limit of the stack below 512 kB is raised, or refused in one line if the system forbids it. (With 64 kB, Debian 13 cannot load the
        libraries.)"""
        args = [HYCO, 'solve', *R]
        soft, hard = 128 * 1024, resource.getrlimit(resource.RLIMIT_STACK)[1]
        run = subprocess.run(args, cwd=self.folder, capture_output=True, text=True, timeout=30 * PATIENCE, check=False,
                             preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_STACK, (soft, hard)))
        self.assertEqual(run.returncode, 0, run.stderr)
        for ranks in (0, 2):
            limited = ['sh', '-c', 'ulimit -s 128; exec "$@"', 'sh', *args]
            run = subprocess.run([*MPIRUN, str(ranks), *limited] if ranks else limited, cwd=self.folder, capture_output=True, text=True,
                                 timeout=30 * PATIENCE, check=False)
            self.assertEqual((run.returncode, said(run)), (1, ['hyco: error: the stack is limited to 128 kB, and 512 kB are needed; raise the limit: '
                                                              'ulimit -s 8192']), run.stderr)
        ROWS.add('a stack of 128 kB, on 1 and 2 ranks', 'the limit is raised, or one line')

    def test_closed_pipe(self):
        """Who reads the output has left: no message, and no error."""
        for args in (['help'], ['solve', '-help'], ['view', '-model', 'rope.h5']):
            read, write = os.pipe()
            os.close(read)
            run = subprocess.run([HYCO, *args], cwd=self.folder, stdout=write, stderr=subprocess.PIPE, text=True, timeout=30 * PATIENCE, check=False)
            os.close(write)
            self.assertEqual((run.returncode, run.stderr), (0, ''), args)

    def test_printable(self):
        """Bytes that could change a terminal are not in messages; letters of any language are."""
        args = [HYCO.encode(), b'solve', b'-scene', ROPE.encode(), b'-mu', b'0.1,0.1', b'-body_rope_young', 'é\u009b'.encode() + b'\x1b[31m\xff\x07']
        run = subprocess.run(args, cwd=self.folder, capture_output=True, timeout=30 * PATIENCE, check=False)
        self.assertEqual(run.returncode, 1)
        self.assertIn('"é???[31m??"'.encode(), run.stderr)

    def apart(self, text, *args, other=(), folder='.'):
        """Rank 0 is correct; ranks 1 and 2 are in another folder or have other arguments: one line, status 1, soon."""
        run = subprocess.run([*MPIRUN, '3', 'sh', '-c', APART, 'sh', HYCO, *settled(args)], cwd=self.folder, capture_output=True, text=True, timeout=30 * PATIENCE,
                             env=dict(os.environ, OTHER_FOLDER=self.path(folder), OTHER_ARGUMENTS=shlex.join(other)))
        lines = said(run)
        self.assertEqual(run.returncode, 1, run.stderr)
        self.assertEqual(len(lines), 1, run.stderr)
        self.assertTrue(lines[0].startswith('hyco: error: '), lines[0])
        self.assertIn(text, lines[0])

    def test_other_ranks(self):
        """Files that other ranks cannot see, or see damaged, and entries that only they were given."""
        for name in ('scene.yaml', 'rope.msh'):
            shutil.copy(os.path.join(ROPE, name), self.path(name))
        shutil.copy(self.path('cut.h5'), self.path('elsewhere', 'rope.h5'))
        tries = (('the scene scene.yaml does not exist', ['solve', '-scene', 'scene.yaml', '-mu', '0.07,0.17'], (), 'elsewhere'),
                 ('p.csv cannot be opened', ['train', *T, '-points', 'p.csv'], (), 'elsewhere'),
                 ('rope.h5 is not an HDF5 file, or it is damaged', ['predict', '-model', 'rope.h5', '-mu', '0.07,0.17'], (), 'elsewhere'),
                 ('rope.h5 is not an HDF5 file, or it is damaged', ['compare', '-scene', ROPE, '-model', 'rope.h5', *N], (), 'elsewhere'),
                 ('"2*(x" is not an expression', ['solve', *R], ('-body_rope_young', '2*(x'), '.'))
        for text, args, other, folder in tries:
            with self.subTest(args=' '.join(args), other=other):
                self.apart(text, *args, other=other, folder=folder)
        with open(self.path('elsewhere', 'scene.yaml'), 'w', encoding='ascii') as f:
            f.write('scene: [\n')
        self.apart('not valid YAML for hyco', 'solve', '-scene', 'scene.yaml', '-mu', '0.07,0.17', folder='elsewhere')
        for name in ('scene.yaml', 'rope.msh', os.path.join('elsewhere', 'scene.yaml'), os.path.join('elsewhere', 'rope.h5')):
            os.remove(self.path(name))
        ROWS.add(f'files that are missing or damaged on some ranks, entries that only some ranks have ({len(tries) + 1}), on 3 ranks',
                 'one line, status 1, no rank left waiting')


if __name__ == '__main__':
    unittest.main()
