"""What is public, by task."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Task:
    """One chapter of the page.

    Parameters
    ----------
    key : str
        Anchor of the chapter, and the name of those of its parts that have none of their own.
    title : str
        Heading.
    about : str
        What it is for, in the markup of docstrings.
    names : tuple of str
        Dotted names; of a module, all its public classes, functions and described constants.
    """

    key: str
    title: str
    about: str
    names: tuple[str, ...]


TASKS = (
    Task(
        "run-and-compare",
        "Run and compare",
        "One run, several side by side, and whether a method satisfies its claims. A problem is given by its name, by the path of a "
        "problem file, or as a definition.",
        (
            "daebench.run",
            "daebench.load",
            "daebench.read_model",
            "daebench.Model",
            "daebench.methods.plan.plan",
            "daebench.gradient",
            "daebench.Gradient",
            "daebench.compare",
            "daebench.order",
            "daebench.check",
            "daebench.list_problems",
            "daebench.list_methods",
            "daebench.studies.claims.bench.Finding",
            "daebench.initial_value_problem",
            "daebench.InitialValueProblem",
            "daebench.runs.own_start.OwnStart",
            "daebench.Trajectory",
            "daebench.PoissonTrajectory",
            "daebench.runs.trajectory.Outcome",
            "daebench.runs.trajectory.Passage",
            "daebench.runs.solver_steps.SolverSteps",
            "daebench.joints.reactions.Load",
            "daebench.runs.request.Request",
            "daebench.methods.names.parse",
            "daebench.methods.outside.callables.method_of_callable",
            "daebench.methods.outside.method.Stated",
            "daebench.runs.ivp.ConstrainedIvp",
            "daebench.runs.ivp.PoissonIvp",
        ),
    ),
    Task(
        "many-starts",
        "Many starts, and chaos",
        "Ensembles of starts, their distributions, and maps of chaos.",
        (
            "daebench.ensemble",
            "daebench.Ensemble",
            "daebench.starts.draw.draw_starts",
            "daebench.starts.members.Neighbourhood",
            "daebench.starts.liouville.Liouville",
            "daebench.starts.energy.Energy",
            "daebench.starts.members.Grid",
            "daebench.starts.box.Vary",
            "daebench.starts.members.Starts",
            "daebench.methods.ensemble.result.EnsembleRun",
            "daebench.studies.ensemble.references.member_references",
            "daebench.studies.ensemble.references.MemberReferences",
            "daebench.runs.members.Members",
            "daebench.chaos",
            "daebench.Chaos",
            "daebench.studies.chaos.plane.Plane",
        ),
    ),
    Task(
        "choose-a-method",
        "Choose a method",
        "Which method to take, with which step size, with which stabilisation.",
        (
            "daebench.baumgarte",
            "daebench.BaumgarteMap",
            "daebench.studies.baumgarte.result.Effect",
            "daebench.studies.baumgarte.result.Limit",
            "daebench.studies.baumgarte.cells.Cell",
            "daebench.shadow",
            "daebench.Shadow",
            "daebench.modes",
            "daebench.Modes",
            "daebench.studies.modes.equilibrium.Equilibrium",
            "daebench.advise",
            "daebench.Advice",
            "daebench.studies.advise.question.Question",
            "daebench.studies.advise.advice.Choice",
            "daebench.studies.advise.evidence.Kept",
            "daebench.studies.advise.evidence.Change",
            "daebench.studies.advise.evidence.OverStarts",
            "daebench.step_for",
            "daebench.tolerance_for",
            "daebench.ToleranceFor",
            "daebench.studies.tolerance_for.TriedTolerance",
            "daebench.StepFor",
            "daebench.studies.step_for.result.Tried",
        ),
    ),
    Task(
        "declare-a-study",
        "Declare a study",
        """A grid of runs, each made once and kept in an SQLite file under the hash of all that decides its numbers::

    with opened(Path("study.db")) as store:
        table = study.table(store)      # one row a run; stopped any way you like, only what is missing is made

Runs that are timed are made one at a time, unless ``beside`` says otherwise, and which of the two is kept with their times. Runs that
are not timed go to any executor: the cores of this machine, or the workers of a Dask cluster (extra ``scale``). Very long runs keep
checkpoints instead, in a folder of their own.""",
        (
            "daebench.Study",
            "daebench.starts.members.neighbour",
            "daebench.records.store.opened",
            "daebench.records.store.Store",
            "daebench.records.rows.StoredRow",
            "daebench.records.store.StoreFull",
            "daebench.studies.grid.run_specification.RunSpecification",
            "daebench.studies.grid.run_specification.GridRun",
            "daebench.studies.grid.metrics.METRICS",
            "daebench.studies.grid.metrics.Metric",
            "daebench.studies.grid.metrics.Measured",
            "daebench.long",
            "daebench.LongRuns",
            "daebench.studies.long.findings.Findings",
            "daebench.studies.long.run.LongRun",
            "daebench.studies.long.ensemble.Ensemble",
            "daebench.studies.grid.member_runs.MemberRuns",
            "daebench.work_precision",
            "daebench.precision",
            "daebench.stability",
            "daebench.studies.stability.extreme.Asked",
            "daebench.studies.grid.schedulers.local_processes",
        ),
    ),
    Task(
        "certify-a-code",
        "Diagnose and certify a code",
        """A code from outside, measured on some problems, and written down with all that is needed to measure it again::

    certificate = daebench.certify("./mine.py:step", problems=["double_pendulum:swing"], out="certificate")
    print(certificate.holds, certificate.falls_short)
    print(daebench.verify_certificate("certificate").sentence)

To verify a certificate is to execute the code that stands beside it.""",
        (
            "daebench.diagnose",
            "daebench.studies.diagnose.diagnosis.Diagnosis",
            "daebench.studies.diagnose.dictionary",
            "daebench.certify",
            "daebench.generate",
            "daebench.pages.generation.generate.Generated",
            "daebench.verify_certificate",
            "daebench.studies.certificate.record.Certificate",
            "daebench.studies.certificate.verify.Unverified",
            "daebench.studies.certificate.verify.Verification",
            "daebench.records.comparison.compare",
            "daebench.records.comparison.Compared",
        ),
    ),
    Task(
        "test-your-code",
        "Test your code against certified references",
        "Assertions for the tests of any code; pytest has them as fixtures of the same names.",
        (
            "daebench.testing",
            "daebench.reference.keep.record.Reference",
            "daebench.reference.keep.store.names",
            "daebench.reference.keep.store.load",
            "daebench.reference.keep.store.find",
            "daebench.reference.keep.store.Damaged",
        ),
    ),
    Task(
        "write-a-problem",
        "Write a problem",
        """A problem file is a docstring and a function ``problem(*, ...)`` that returns one of these records. Arguments annotated ``float``
are run-time parameters, ``int`` ones change the structure.

- It is executed when it is used, with all that it imports: run those of people you trust.
- A mistake gets one sentence that names the file, the line or the case, and what to do.
- ``daebench check FILE`` holds all that it declares against its equations, in all its cases. Other commands check the case they use,
  once per text of the file.
- It may import the files beside it by their plain names, at its top or inside ``problem``. What is edited there is noticed, as long as
  import statements name it; data files that it reads, and packages installed elsewhere, are not watched.
- A package brings problems by entry points of the group ``daebench.problems``; ``daebench list problems`` has them without importing
  them, and says which are broken.
- A chain, whose constraints tie neighbours, is written at one node. With more than seven nodes vectors are arrays, and the files of the
  schemes, unchanged, become a few loops over the nodes with a banded elimination with pivoting between them. What such loops cannot
  do, as solving with a full Jacobian, is refused.""",
        (
            "daebench.ConstrainedHamiltonian",
            "daebench.Case",
            "daebench.coordinates",
            "daebench.KineticFlow",
            "daebench.Chart",
            "daebench.Picture",
            "daebench.ConstrainedChain",
            "daebench.PoissonSystem",
            "daebench.PoissonCase",
            "daebench.Part",
            "daebench.DarbouxMap",
            "daebench.Lift",
            "daebench.PoissonLattice",
            "daebench.as_poisson",
            "daebench.symplectic_projection",
        ),
    ),
    Task(
        "build-a-mechanism",
        "Build a mechanism",
        """Bodies by the points and directions that are fixed in them, joints between them, and forces; what comes out is a
:class:`daebench.ConstrainedHamiltonian`::

    from daebench.joints import Mechanism, Rod

    pendulum = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (2, 0)},
        bodies={"upper": Rod("O", "A", mass=1), "lower": Rod("A", "B", mass=1)},
        gravity=(0, "-9.81"),
    )
    problem = pendulum.problem()

Points that two bodies name join them at no cost. The names of points are in the pictures of what comes out, and ``run --json`` has their
places at its end under ``points``.""",
        (
            "daebench.joints.mechanism.Mechanism",
            "daebench.joints.starts.Start",
            "daebench.joints.bodies",
            "daebench.joints.placing.Guided",
            "daebench.joints.joints.Spherical",
            "daebench.joints.joints.Revolute",
            "daebench.joints.joints.Universal",
            "daebench.joints.joints.Cylindrical",
            "daebench.joints.joints.Prismatic",
            "daebench.joints.joints.Fixed",
            "daebench.joints.joints.Slot",
            "daebench.joints.joints.Distance",
            "daebench.joints.rolling.Rolling",
            "daebench.joints.rolling.KnifeEdge",
            "daebench.joints.forces.Spring",
            "daebench.joints.forces.Damper",
            "daebench.joints.angles.Angle",
            "daebench.joints.angles.Travel",
            "daebench.joints.angles.Spin",
            "daebench.joints.angles.Gear",
            "daebench.joints.angles.Coupling",
            "daebench.joints.torques.Torque",
            "daebench.joints.torques.RotationalSpring",
            "daebench.joints.torques.RotationalDamper",
            "daebench.joints.torques.PDMotor",
            "daebench.joints.drivers.DrivenAngle",
            "daebench.joints.drivers.DrivenDistance",
            "daebench.joints.drivers.DrivenCoordinate",
        ),
    ),
    Task(
        "write-a-scheme",
        "Write a scheme",
        "A scheme file is ``CLAIMS`` and a function ``step``; it may import what these modules name.",
        (
            "daebench.schemes.kernels.claims.Claims",
            "daebench.schemes.kernels.claims.PoissonClaims",
            "daebench.schemes.kernels.claims.Member",
            "daebench.schemes.kernels.language",
            "daebench.schemes.kernels.spaces",
            "daebench.schemes.kernels.poisson_language",
        ),
    ),
    Task(
        "measure",
        "Measure",
        "Drifts, defects and orders of a run or a map of your own, as functions of numbers.",
        (
            "daebench.diagnostics.energy.energy_drift",
            "daebench.diagnostics.drift.Drift",
            "daebench.diagnostics.manifold.manifold_drift",
            "daebench.diagnostics.manifold.ManifoldDrift",
            "daebench.diagnostics.order.fit_order",
            "daebench.diagnostics.order.OrderFit",
            "daebench.diagnostics.symplecticity.tangent_basis",
            "daebench.diagnostics.symplecticity.areas",
            "daebench.diagnostics.symplecticity.symplecticity_defect",
            "daebench.diagnostics.two_form_rate.two_form_rate",
            "daebench.diagnostics.shadow.shadow_hamiltonian",
            "daebench.diagnostics.reversibility.reversibility_defect",
            "daebench.diagnostics.poisson.poisson_defect",
            "daebench.diagnostics.consistency.consistency",
            "daebench.diagnostics.consistency.project",
            "daebench.diagnostics.freedom.freedom",
            "daebench.diagnostics.freedom.Freedom",
            "daebench.diagnostics.reactions.reactions",
            "daebench.diagnostics.reactions.Reactions",
        ),
    ),
    Task(
        "write-a-report",
        "Write a report",
        "Numbers in words, tables, figures in the page, and the page itself.",
        (
            "daebench.pages.report",
            "daebench.draw.figures.drawing",
            "daebench.draw.figures.grid_of_axes",
            "daebench.draw.figures.legend_below",
            "daebench.draw.figures.save",
            "daebench.draw.figures.save_picture",
            "daebench.draw.figures.Stroke",
        ),
    ),
    Task(
        "animate-and-draw",
        "Animate, and draw panels",
        "Animations of an initial value problem, and panels of curves as SVG in milliseconds, for lessons.",
        (
            "daebench.animation",
            "daebench.pages.animation.animation.Animated",
            "daebench.draw.svg.axis.Axis",
            "daebench.draw.svg.marks.Curve",
            "daebench.draw.svg.marks.Dots",
            "daebench.draw.svg.panels.Panel",
            "daebench.draw.svg.panels.draw_panels",
        ),
    ),
    Task(
        "errors",
        "Errors",
        "Every message is one sentence: what, where, and what to do.",
        (
            "daebench.DaebenchError",
            "daebench.BadInput",
            "daebench.InconsistentStart",
            "daebench.InvalidProblem",
            "daebench.RunFailed",
            "daebench.errors.Interrupted",
        ),
    ),
)
"""The chapters in their order."""
