"""Mechanisms: bodies in natural coordinates - points and directions that are fixed in them - and the joints between them.

::

    from daebench.joints import Body, Mechanism, Rod

    pendulum = Mechanism(
        ground={"O": (0, 0)},
        points={"A": (1, 0), "B": (2, 0)},
        bodies={"upper": Rod("O", "A", mass=1), "lower": Rod("A", "B", mass=1)},
        gravity=(0, "-9.81"),
    )
    problem = pendulum.problem()      # a ConstrainedHamiltonian: four unknowns, two constraints

Positions are unknowns in place of angles, so that the mass matrix is constant and constraints are polynomials of degree 2: J. Garcia de
Jalon and E. Bayo, *Kinematic and Dynamic Simulation of Multibody Systems*, Springer 1994, chapters 2 to 4.
"""

from daebench.joints.angles import Angle as Angle
from daebench.joints.angles import Coupling as Coupling
from daebench.joints.angles import Gear as Gear
from daebench.joints.angles import Spin as Spin
from daebench.joints.angles import Travel as Travel
from daebench.joints.bodies import Body as Body
from daebench.joints.bodies import Plate as Plate
from daebench.joints.bodies import PointMass as PointMass
from daebench.joints.bodies import QuaternionBody as QuaternionBody
from daebench.joints.bodies import Rod as Rod
from daebench.joints.drivers import DrivenAngle as DrivenAngle
from daebench.joints.drivers import DrivenCoordinate as DrivenCoordinate
from daebench.joints.drivers import DrivenDistance as DrivenDistance
from daebench.joints.drivers import t as t
from daebench.joints.forces import Damper as Damper
from daebench.joints.forces import NegativeDamping as NegativeDamping
from daebench.joints.forces import Spring as Spring
from daebench.joints.joints import Cylindrical as Cylindrical
from daebench.joints.joints import Distance as Distance
from daebench.joints.joints import Fixed as Fixed
from daebench.joints.joints import Prismatic as Prismatic
from daebench.joints.joints import Revolute as Revolute
from daebench.joints.joints import Slot as Slot
from daebench.joints.joints import Spherical as Spherical
from daebench.joints.joints import Universal as Universal
from daebench.joints.mechanism import Mechanism as Mechanism
from daebench.joints.placing import Guided as Guided
from daebench.joints.rolling import KnifeEdge as KnifeEdge
from daebench.joints.rolling import Rolling as Rolling
from daebench.joints.starts import Start as Start
from daebench.joints.torques import PDMotor as PDMotor
from daebench.joints.torques import RotationalDamper as RotationalDamper
from daebench.joints.torques import RotationalSpring as RotationalSpring
from daebench.joints.torques import Torque as Torque
from daebench.joints.written import points as points
from daebench.joints.written import rods as rods
