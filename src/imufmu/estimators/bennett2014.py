"""Kalman filter for two links with an IMU on each, the accelerometer corrected for the motion of the links [1].

    paper        here               unit        meaning
    theta, omega, alpha             rad, ...    angle of a joint, its first and second derivative
    x            state.x                        (x, y, theta_1, omega_1, alpha_1, theta_2, omega_2, alpha_2, b_1, b_2)
    P            state.P                        its covariance
    beta         b_1, b_2           rad/s       gyroscope biases about the joint axis
    s_1, s_2     m.s                rad/s       rates of sensors 1 and 2 about the joint axis
    A_x, A_y     m.A                m/s2        accelerometer of sensor 2, along and across the link
    s_3                             rad         theta_1 + theta_2 from the accelerometer
    T_S          p.sample_period    s
    sigma_1, sigma_2                            p.r1, p.r2: entries of R as they are, variances
    sigma_s, sigma_f                            p.r3_slow, p.r3_fast: the same
    sigma_d      p.q_d              m2          entry of Q for x and y, per sample
    sigma_theta  p.q_1, p.q_2       rad2/s5     density of the white jerk of each joint
    sigma_beta   p.q_b              rad2/s2     entry of Q for the biases, per sample

Frames. The links turn in a vertical plane. Frame 0 lies in joint 1: x_0 horizontal, y_0 up, z_0 = x_0 x y_0 the axis of
both joints. theta_1 is the angle of link 1 from x_0 (-90 deg: it hangs down), theta_2 that of link 2 from link 1. Both
sensors are mounted alike (Fig. 3): x along the link, away from its joint; z opposite to the joint axis, (8); y = z x x,
so with theta_1 + theta_2 = 0 it points down. Hence s_i = -gyro_i[3], and (A_x, A_y) = accel2[1..2] at rest is (-g, 0).
Roll and pitch are not reported: a hanging sensor stands at the singularity of Euler angles, segment_angle has none.

For the double pendulum of this package theta_1 = angle[1] - pi/2, theta_2 = angle[2], a1 = length[1], a2 =
imu_distance, and mount = (0, pi/2, pi/2) turns its sensor into this frame.

The arm, with theta_12 = theta_1 + theta_2, omega_12 and alpha_12 likewise. Where sensor 2 is, and what acceleration it
feels by the motion, in frame 0 and along its own axes:

    x = a_1 cos theta_1 + a_2 cos theta_12,   y = a_1 sin theta_1 + a_2 sin theta_12           (2), (5)
    x'' = -a_1 (omega_1^2 cos theta_1 + alpha_1 sin theta_1)
        - a_2 (omega_12^2 cos theta_12 + alpha_12 sin theta_12)                                (4)
    y'' = a_1 (alpha_1 cos theta_1 - omega_1^2 sin theta_1)
        + a_2 (alpha_12 cos theta_12 - omega_12^2 sin theta_12)                                (7)
    A_rad = x'' cos theta_12 + y'' sin theta_12,   A_tan = x'' sin theta_12 - y'' cos theta_12    (8)
    g_x = A_x - A_rad,   g_y = A_y - A_tan                                                     (9)

The filter: each joint has a white jerk of density q over T = T_S, the position follows by its derivatives with respect
to the angles, and there are three measurements:

    x- = Phi x+,   P- = Phi P+ Phi' + Q                                                        (19), (20)
    Q = diag(q_d, q_d, q_1 B, q_2 B, q_b, q_b),   B = [T^5/20 T^4/8 T^3/6; T^4/8 T^3/3 T^2/2; T^3/6 T^2/2 T]    (18)
    s_1 = omega_1 + b_1,   s_2 = omega_1 + omega_2 + b_2,   s_3 = theta_1 + theta_2            (15)

R of s_3 is sigma_s while both rates are below delta, sigma_f otherwise (17).

Only theta_1 + theta_2 and b_2 are observable: an error of b_1 turns theta_1 and theta_2 away from each other for good.

Differences from the paper: R is diagonal, so (21) to (23) take one measurement after the other, which is the same and
needs no inverse; (23) is computed for one triangle of P: with rounding errors that differ between the two it
diverges. s_3 = atan2(g_x, -g_y) has the zero of theta_1 + theta_2, which (1) has not, and its innovation is wrapped.
(1) and (8) contradict each other in the sign of the accelerometer; (8) is taken. The filter starts at once from the
angles and biases given. The paper's two preparations of the whole record are options: ``median``, then two samples
late, and the biases from a rest at the start, ``rest_time``. A missing gyroscope sample is held, an
accelerometer sample that is missing or points nowhere is predicted over.

[1] Bennett, Jafari, Gans, Motion Based Acceleration Correction for Improved Sensor Orientation Estimates, BSN 2014
"""

from __future__ import annotations

from math import pi
from types import SimpleNamespace
from typing import Any

import casadi as ca

from ..blocks import vocabulary as v
from ..blocks.block import Expressions, SampledBlock
from ..blocks.rotations import angle_of, root
from ..blocks.signals import Parameter, Signal, State, integer, real, switch
from .kalman import symmetric, update
from .running_median import DELAY, WINDOW, running_median

GYRO_ONLY, RAW, CORRECTED = 0, 1, 2
BOTH_RATES, SUM_OF_RATES = 0, 1
PREDICTED, PREVIOUS = 0, 1

STATES = 10
X, Y, THETA1, OMEGA1, ALPHA1, THETA2, OMEGA2, ALPHA2, BIAS1, BIAS2 = range(STATES)
ANGLES, RATES, ACCELERATIONS, BIASES = [THETA1, THETA2], [OMEGA1, OMEGA2], [ALPHA1, ALPHA2], [BIAS1, BIAS2]
S1, S2, S3 = (  # the rows of H, (15)
    dict.fromkeys(states, 1) for states in ((OMEGA1, BIAS1), (OMEGA1, OMEGA2, BIAS2), (THETA1, THETA2))
)
START_VARIANCES = (1e-6, 1e-6, 1e-4, 1e-4, 1e-2, 1e-4, 1e-4, 1e-2, 1e-6, 1e-6)
CHANNELS = 6  # of the window: s_1, s_2, A_x, A_y, gyroscope missing, accelerometer missing
NO_DIRECTION = 1e-5  # m/s2: a shorter gravity vector points nowhere


# The arm


def segment_angle(x: Any) -> Any:
    """theta_1 + theta_2."""
    return x[THETA1] + x[THETA2]


def position(x: Any, p: SimpleNamespace) -> tuple[Any, Any]:
    """Place of sensor 2 in frame 0. (2), (5)"""
    th1, th12 = x[THETA1], segment_angle(x)
    return p.a1 * ca.cos(th1) + p.a2 * ca.cos(th12), p.a1 * ca.sin(th1) + p.a2 * ca.sin(th12)


def motion_acceleration(x: Any, p: SimpleNamespace) -> Any:
    """Acceleration of sensor 2 by the motion of the links, (A_rad, A_tan) in its own frame."""
    c1, s1 = ca.cos(x[THETA1]), ca.sin(x[THETA1])
    c12, s12 = ca.cos(segment_angle(x)), ca.sin(segment_angle(x))
    w1, w12 = x[OMEGA1], x[OMEGA1] + x[OMEGA2]
    al1, al12 = x[ALPHA1], x[ALPHA1] + x[ALPHA2]
    x_dd = -p.a1 * (c1 * w1**2 + s1 * al1) - p.a2 * c12 * w12**2 - p.a2 * s12 * al12  # (4)
    y_dd = p.a1 * (c1 * al1 - s1 * w1**2) + p.a2 * c12 * al12 - p.a2 * s12 * w12**2  # (7)
    return ca.vertcat(c12 * x_dd + s12 * y_dd, s12 * x_dd - c12 * y_dd)  # (8)


def angle_from_gravity(g: Any) -> Any:
    """theta_1 + theta_2 from (g_x, g_y), what an accelerometer at rest reads in the frame of (8)."""
    return angle_of(g[0], -g[1])  # (1), from x_0


# The filter


def transition(x: Any, p: SimpleNamespace) -> Any:
    """Phi. (12)"""
    x_position, y_position = position(x, p)
    F = ca.SX(STATES, STATES)  # (11)
    F[X, OMEGA1], F[X, OMEGA2] = -y_position, -p.a2 * ca.sin(segment_angle(x))  # A, B of (3)
    F[Y, OMEGA1], F[Y, OMEGA2] = x_position, p.a2 * ca.cos(segment_angle(x))  # C, D of (6)
    for angle, rate, acceleration in ((THETA1, OMEGA1, ALPHA1), (THETA2, OMEGA2, ALPHA2)):
        F[angle, rate] = F[rate, acceleration] = 1
    return ca.SX.eye(STATES) + F * p.sample_period


def process_noise(p: SimpleNamespace) -> Any:
    """Q: every acceleration a random walk. (18)"""
    T = p.sample_period
    B = ca.blockcat([[T**5 / 20, T**4 / 8, T**3 / 6], [T**4 / 8, T**3 / 3, T**2 / 2], [T**3 / 6, T**2 / 2, T]])
    return ca.diagcat(p.q_d, p.q_d, p.q_1 * B, p.q_2 * B, p.q_b, p.q_b)


def filter_sample(state: SimpleNamespace, m: SimpleNamespace, p: SimpleNamespace) -> SimpleNamespace:
    """(19) to (23) for one sample m."""
    Phi = transition(state.x, p)
    x = Phi @ state.x  # (19)
    P = symmetric(Phi @ state.P @ Phi.T + process_noise(p))  # (20)

    moving = motion_acceleration(ca.if_else(p.corr_state == PREVIOUS, state.x, x), p)
    g = m.A - moving  # (9)
    used = ca.if_else(p.variant == CORRECTED, g, m.A)
    s3 = nearest_turn(angle_from_gravity(used), segment_angle(x))
    asked = ca.logic_and(p.variant != GYRO_ONLY, ca.logic_not(m.accel_missing))
    accepted = ca.logic_and(asked, points(used))

    x, P = update(x, P, S1, m.s[0], p.r1)  # (21) to (23)
    x, P = update(x, P, S2, m.s[1], p.r2)
    x, P = update(x, P, S3, s3, ca.if_else(is_slow(m, p), p.r3_slow, p.r3_fast), accepted)  # (16)
    return SimpleNamespace(x=x, P=P, corrected_angle=angle_from_gravity(g), rejected=ca.logic_and(asked, 1 - accepted))


def is_slow(m: SimpleNamespace, p: SimpleNamespace) -> Any:
    """1 where the accelerometer deserves trust. (17)"""
    s1, s2 = ca.fabs(m.s[0]), ca.fabs(m.s[1])
    return ca.if_else(p.slow_rule == SUM_OF_RATES, s1 + s2, ca.fmax(s1, s2)) < p.delta


def points(g: Any) -> Any:
    """1 where a gravity vector has a direction."""
    return ca.norm_2(g) > NO_DIRECTION


def nearest_turn(angle: Any, to: Any) -> Any:
    """The angle, by whole turns as near as possible to another one."""
    return to + ca.atan2(ca.sin(angle - to), ca.cos(angle - to))


# The stream of samples


def before_the_first_sample(p: SimpleNamespace) -> SimpleNamespace:
    """State of the given angles and biases at rest."""
    x = ca.SX.zeros(STATES)
    x[ANGLES], x[BIASES] = p.initial_angle, p.initial_bias
    x[X], x[Y] = position(x, p)
    return SimpleNamespace(x=x, P=ca.diag(p.P0), window=ca.SX.zeros(WINDOW, CHANNELS), taken=0, averaged=0)


def sample(window: Any, taken: Any, p: SimpleNamespace) -> SimpleNamespace:
    """The sample to filter: the newest, or the median of the window. Missing is what is missing in most of it."""
    channels = ca.if_else(p.median, running_median(window, taken), window[0, :].T)
    return SimpleNamespace(
        s=channels[:2], A=channels[2:4], gyro_missing=channels[4] >= 0.5, accel_missing=channels[5] >= 0.5
    )


def hold(state: SimpleNamespace, m: SimpleNamespace, learning: Any) -> tuple[Any, Any]:
    """The state as it is, its biases the mean of the samples so far while learning; and the number of those samples."""
    use = ca.logic_and(learning, ca.logic_not(m.gyro_missing))
    averaged = state.averaged + use
    x = ca.SX(state.x)
    x[BIASES] += ca.if_else(use, (m.s - x[BIASES]) / averaged, 0)
    return x, averaged


def step(state: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """One sample: while the window fills and during the rest the state is held, then the filter runs."""
    no_gyro = ca.logic_or(u.gyro1_missing, u.gyro2_missing)
    newest = ca.horzcat(-u.gyro1[2], -u.gyro2[2], u.accel2[:2].T, no_gyro, u.accel2_missing)
    window, taken = ca.vertcat(newest, state.window[:-1, :]), state.taken + 1
    m = sample(window, taken, p)

    number = taken - 1 - DELAY * p.median  # of sample m; number 0 belongs to the state at the start
    rest_samples = ca.floor(p.rest_time / p.sample_period + 0.5)
    resting = number < rest_samples
    x_held, averaged = hold(state, m, ca.logic_and(number >= 0, resting))
    new = filter_sample(state, m, p)
    running = ca.logic_and(number >= 1, ca.logic_not(resting))
    return dict(
        x=ca.if_else(running, new.x, x_held),
        P=ca.if_else(running, new.P, state.P),
        window=window,
        taken=taken,
        averaged=averaged,
        raw_angle=angle_from_gravity(m.A),
        corrected_angle=ca.if_else(running, new.corrected_angle, angle_from_gravity(m.A)),
        slow=is_slow(m, p),
        rejected=ca.logic_and(running, new.rejected),
        held=ca.logic_or(number < 0, resting),
    )


def initial(u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """The first sample."""
    return step(before_the_first_sample(p), u, p)


def output(state: SimpleNamespace, u: SimpleNamespace, p: SimpleNamespace) -> Expressions:
    """Outputs of one sample."""
    x, angle = state.x, segment_angle(state.x)
    return dict(
        segment_angle=angle,
        angle=x[ANGLES],
        angle_rate=x[RATES],
        gyro_bias=x[BIASES],
        vertical=ca.vertcat(ca.sin(angle), -ca.cos(angle), 0),  # second column of (8)
        external_acceleration=ca.vertcat(motion_acceleration(x, p), 0),
        tilt_std=root(ca.sum1(ca.sum2(state.P[ANGLES, ANGLES]))),
        status=v.Status.GYRO_MISSING * ca.logic_or(u.gyro1_missing, u.gyro2_missing)
        + v.Status.ACCEL_MISSING * u.accel2_missing
        + v.Status.ACCEL_REJECTED * state.rejected
        + v.Status.NOT_INITIALISED * state.held,
        delay=DELAY * p.median * p.sample_period,
        position=x[:2],
        angle_acceleration=x[ACCELERATIONS],
        raw_angle=state.raw_angle,
        corrected_angle=state.corrected_angle,
        slow=state.slow,
        P=state.P,
    )


_RATE = v.GYRO.maximum
_DESCRIPTION = "Reading of the {}, x along the link away from its joint, z opposite to the joint axis"


def variance(name: str, unit: str, start: float, least: float, description: str) -> Parameter:
    """A tuning parameter: positive, or zero where that leaves the filter solvable."""
    return real(name, unit, start, (least, 1e6), description, tunable=True)


BLOCK = SampledBlock(
    name="bennett2014",
    summary="Joint angles of a planar two-link arm from two IMUs: Kalman filter with acceleration correction "
    "(Bennett et al. 2014)",
    doc="""Estimates the angles of two links that turn in one vertical plane (a leg, a robot arm) from a gyroscope on
each and an accelerometer on the second. The kinematics of the links predict what the accelerometer feels of the motion;
what is left is gravity, whose direction corrects theta_1 + theta_2, the segment_angle. The angle of a single joint
drifts with the gyroscope bias of link 1. The filter starts from initial_angle and initial_bias. With rest_time the arm
must rest there for that time, and the biases are learnt meanwhile; status shows 32 until then. The variants without
accelerometer and with the raw one are for comparison. Both sensors must lie in the plane with their axes along the
links: a mounting error appears in the estimate in full. Enter the distance of sensor 2 from joint 2 as a2. To get what
the paper computes of a whole record, switch median on, and read its sample k at sample k + 2; or feed arrays filtered
by imufmu.estimators.running_median.centred_median.""",
    reference="T. R. Bennett, R. Jafari, N. Gans, Motion Based Acceleration Correction for Improved Sensor "
    "Orientation Estimates, 11th International Conference on Wearable and Implantable Body Sensor Networks, 2014",
    when="""Use it for two rigid links that turn in one vertical plane with a sensor on each: a leg in walking, a
robot arm. Knowing the lengths it takes the motion out of the accelerometer, which no filter of a single sensor can.
Instead: plumb on the sensor of the segment, where the motion leaves the plane, the lengths are not known or one
sensor is all there is; its tilt is as good in the arm moved by hand. No filter here knows the angle of a single
joint for long.""",
    inputs=(
        Signal("gyro1", "rad/s", _DESCRIPTION.format("gyroscope on link 1"), -_RATE, _RATE, (3,)),
        Signal("gyro2", "rad/s", _DESCRIPTION.format("gyroscope on link 2"), -_RATE, _RATE, (3,)),
        Signal(
            "accel2",
            "m/s2",
            _DESCRIPTION.format("accelerometer on link 2"),
            v.ACCEL.minimum,
            v.ACCEL.maximum,
            (3,),
            (-v.GRAVITY, 0.0, 0.0),
            v.ACCEL.nominal,
        ),
    ),
    outputs=(
        Signal("segment_angle", "rad", "Angle of link 2 from the horizontal, theta_1 + theta_2", -1e9, 1e9),
        Signal("angle", "rad", "Joint angles theta_1 from the horizontal and theta_2 from link 1", -1e9, 1e9, (2,)),
        Signal("angle_rate", "rad/s", "Joint rates omega_1 and omega_2", -1e4, 1e4, (2,)),
        Signal("gyro_bias", "rad/s", "Biases of both gyroscopes about the joint axis", -1e3, 1e3, (2,), nominal=0.01),
        v.VERTICAL,
        v.EXTERNAL_ACCELERATION,
        v.TILT_STD,
        v.STATUS,
        Signal("delay", "s", "Age of the estimate at sample_time: two sample periods with median, else 0", 0, 1e4),
    ),
    locals=(
        Signal("position", "m", "Place of sensor 2 from joint 1, horizontal and up", -1e6, 1e6, (2,)),
        Signal("angle_acceleration", "rad/s2", "Joint accelerations alpha_1 and alpha_2", -1e6, 1e6, (2,), nominal=10),
        Signal("raw_angle", "rad", "Segment angle by the accelerometer alone", -pi, pi),
        Signal("corrected_angle", "rad", "Segment angle by the accelerometer corrected for the motion", -pi, pi),
        Signal("slow", "1", "1 while the accelerometer has the variance r3_slow, else 0", 0, 1),
        Signal("P", "1", "Covariance of (x, y, theta_1, omega_1, alpha_1, theta_2, ...)", -1e30, 1e30, (10, 10)),
    ),
    own_parameters=(
        integer("variant", CORRECTED, (0, 2), "0 gyroscopes only, 1 raw accelerometer, 2 corrected", tunable=True),
        real("a1", "m", 0.2, (0, 100), "Length of link 1, joint to joint"),
        real("a2", "m", 0.35, (0, 100), "Distance of sensor 2 from joint 2"),
        variance("q_d", "m2", 1e-8, 0, "Entry of Q for the position, per sample"),
        variance("q_1", "rad2/s5", 1e3, 0, "White jerk density of joint 1; larger follows faster motion"),
        variance("q_2", "rad2/s5", 1e3, 0, "White jerk density of joint 2; larger follows faster motion"),
        variance("q_b", "rad2/s2", 1e-12, 0, "Entry of Q for the biases, per sample"),
        variance("r1", "rad2/s2", 2.25e-6, 1e-12, "Gyroscope variance per sample, link 1"),
        variance("r2", "rad2/s2", 2.25e-6, 1e-12, "Gyroscope variance per sample, link 2"),
        variance("r3_slow", "rad2", 0.01, 1e-12, "Variance of the accelerometer's angle in slow motion"),
        variance("r3_fast", "rad2", 1.0, 1e-12, "Variance of the accelerometer's angle in fast motion"),
        real("delta", "rad/s", 2.0, (0, 1e4), "Threshold between slow and fast motion", tunable=True),
        integer("slow_rule", BOTH_RATES, (0, 1), "0 slow if both rates are below delta, 1 if their sum is"),
        integer("corr_state", PREDICTED, (0, 1), "0 correct by the predicted state, 1 by that of the sample before"),
        switch("median", "Median of five samples on every input; the outputs are two samples late"),
        real("rest_time", "s", 0.0, (0, 1e4), "Rest at the start in which the biases are learnt; the paper has 2 s"),
        real("initial_angle", "rad", (-pi / 2, 0.0), (-2 * pi, 2 * pi), "Joint angles at the start", shape=(2,)),
        real(
            "initial_bias", "rad/s", 0.0, (-100, 100), "Gyroscope biases at the start, about the joint axis", shape=(2,)
        ),
        real("P0", "1", START_VARIANCES, (0, 1e3), "Variances at the start, ordered as P, SI units", shape=(STATES,)),
    ),
    state=(
        State("x", (STATES,)),
        State("P", (STATES, STATES)),
        State("window", (WINDOW, CHANNELS)),
        State("taken"),
        State("averaged"),
        State("raw_angle"),
        State("corrected_angle"),
        State("slow"),
        State("rejected"),
        State("held"),
    ),
    initial=initial,
    step=step,
    output=output,
)
