"""Writes uncertainty_openturns.csv: Sobol' indices, quantiles and a probability of instability by OpenTURNS, for
comparison with analyses.uncertainty.

- Ishigami's function and Sobol's g-function: indices by Jansen's estimators (JansenSensitivityAlgorithm) on 2^15 points
  of a Sobol' sequence (LowDiscrepancyExperiment).
- Distributions: quantiles at five probabilities.
- Hultén's oscillator with damping (jobs/hulten.json) and a coefficient of friction that is lognormal with the median
  0.27 and 0.08 as standard deviation of its logarithm: probability that an eigenvalue of its 4 x 4 matrix grows, by
  FORM, and by simulation (LHS, at most 100 000 points, with the half-width of the 95 % interval).

Needs openturns and numpy:

    python3 docs/data/uncertainty_openturns.py > docs/data/uncertainty_openturns.csv
"""

import math

import numpy as np
import openturns as ot

POINTS = 2**15
LEVELS = (0.01, 0.1, 0.5, 0.8, 0.99)
G = (0.0, 1.0, 4.5, 9.0, 99.0)


def ishigami():
    """Function and inputs."""
    function = ot.SymbolicFunction(["a", "b", "c"], ["sin(a) + 7 * sin(b)^2 + 0.1 * c^4 * sin(a)"])
    return function, ot.JointDistribution([ot.Uniform(-math.pi, math.pi)] * 3)


def g_function():
    """Function and inputs."""
    names = [f"x{k}" for k in range(len(G))]
    product = " * ".join(f"(abs(4 * {n} - 2) + {a}) / (1 + {a})" for n, a in zip(names, G))
    return ot.SymbolicFunction(names, [product]), ot.JointDistribution([ot.Uniform(0, 1)] * len(G))


def indices(name, function, inputs):
    """Rows of first-order and total indices of each input."""
    d = inputs.getDimension()
    doubled = ot.JointDistribution([inputs.getMarginal(k % d) for k in range(2 * d)])
    points = np.array(ot.LowDiscrepancyExperiment(ot.SobolSequence(2 * d), doubled, POINTS, False).generate())
    a, b = points[:, :d], points[:, d:]
    blocks = [a, b]
    for k in range(d):
        mixed = a.copy()
        mixed[:, k] = b[:, k]
        blocks.append(mixed)
    design = ot.Sample(np.vstack(blocks))
    found = ot.JansenSensitivityAlgorithm(design, function(design), POINTS)
    for k, (first, total) in enumerate(zip(found.getFirstOrderIndices(), found.getTotalOrderIndices())):
        print(f"{name},{k},first,{first:.6f}")
        print(f"{name},{k},total,{total:.6f}")


def quantiles():
    """Rows of quantiles of each distribution of a job."""
    truncated = ot.TruncatedDistribution(ot.Normal(-0.006, 0.002), -0.008, -0.001)
    for name, distribution in (
        ("normal", ot.Normal(0.3, 0.05)),
        ("truncated_normal", truncated),
        ("lognormal", ot.LogNormal(math.log(0.0002), 0.5)),
        ("uniform", ot.Uniform(0.2, 0.45)),
        ("triangular", ot.Triangular(0.05, 0.2, 0.45)),
    ):
        for p in LEVELS:
            print(f"{name},{p},quantile,{distribution.computeQuantile(p)[0]:.12g}")


def growth(friction):
    """Largest growth rate of the oscillator, 1/s."""
    first, second = 2 * math.pi * 100, 2 * math.pi * 75
    stiffness = np.array([[first**2, -friction * second**2], [friction * first**2, second**2]])
    damping = np.diag([0.02 * first, 0.02 * second])
    system = np.block([[np.zeros((2, 2)), np.eye(2)], [-stiffness, -damping]])
    return float(np.linalg.eigvals(system).real.max())


def probability():
    """Rows of the probability that the oscillator is unstable."""
    friction = ot.LogNormal(math.log(0.27), 0.08)
    function = ot.PythonFunction(1, 1, lambda x: [growth(x[0])])
    output = ot.CompositeRandomVector(function, ot.RandomVector(friction))
    event = ot.ThresholdEvent(output, ot.Greater(), 0.0)
    simulation = ot.ProbabilitySimulationAlgorithm(event, ot.LHSExperiment())
    ot.RandomGenerator.SetSeed(1)
    simulation.setMaximumOuterSampling(100)
    simulation.setBlockSize(1000)
    simulation.setMaximumCoefficientOfVariation(0.0)
    simulation.run()
    result = simulation.getResult()
    print(f"hulten,,simulated,{result.getProbabilityEstimate():.6f}")
    print(f"hulten,,simulated_half_width,{0.5 * result.getConfidenceLength(0.95):.6f}")
    optimizer = ot.Cobyla()
    optimizer.setStartingPoint([0.29])
    optimizer.setMaximumConstraintError(1e-4)
    for limit in (optimizer.setMaximumAbsoluteError, optimizer.setMaximumRelativeError):
        limit(1e-12)
    form = ot.FORM(optimizer, event)
    form.run()
    print(f"hulten,,form,{form.getResult().getEventProbability():.6f}")


def main():
    print(f"# openturns {ot.__version__}, numpy {np.__version__}: python3 docs/data/uncertainty_openturns.py")
    print("case,input,quantity,value")
    indices("ishigami", *ishigami())
    indices("g_function", *g_function())
    quantiles()
    probability()


main()
