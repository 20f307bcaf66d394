//! The experiment: sample, control, hold the volts, integrate to the next sample.

use super::SimulateError;
use super::controller::ControllerSettings;
use super::effects::{InitialCondition, PlantEffects};
use super::integrate::DormandPrince;
use super::mechanism::Mechanism;
use super::moving::{MovingPlant, part};
use super::plant::Plant;
use super::recorder::LogRecorder;
use super::reference::{Reference, ReferenceFrame, Target};
use super::settings::Settings;
use super::simulated_run::{LimitEvent, MotorStatus, RunEnding, SimulatedRun};
use super::volts::VoltSeries;

/// What drives the motors.
#[derive(Debug, Clone, PartialEq)]
pub enum MotorInput<const J: usize> {
    /// The controller follows a reference.
    Follow {
        reference: Reference<J>,
        control: ControllerSettings<J>,
    },
    /// Volts are played back without looking at the robot.
    Volts(VoltSeries<J>),
}

/// Where the motion starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MotionStart<const J: usize> {
    /// On the reference, displaced by as much as the controller needs to carry the load at rest; in the
    /// middle of the limits, at rest, where no reference is followed.
    Settled,
    /// The initial conditions of the report's block: motor coordinates and their speeds.
    State { position: [f64; J], speed: [f64; J] },
}

/// State sizes that the integrator is compiled for with J joints: the smallest with room is used.
const fn sizes(joints: usize) -> [usize; 4] {
    if joints <= 8 {
        [2, 8, 16, 64]
    } else {
        [32, 32, 64, 128]
    }
}

/// Whether a state of that many numbers is one of [`sizes`] and has room for J joints.
const fn compiled(joints: usize, size: usize) -> bool {
    let [a, b, c, d] = sizes(joints);
    (size == a || size == b || size == c || size == d) && size >= 2 * joints
}

/// Runs one experiment.
///
/// Reaching a limit is no error: see [`SimulatedRun::limits`] and [`SimulatedRun::ending`].
///
/// # Errors
/// [`SimulateError`] where the settings, reference or start cannot be used, or the motion diverges.
pub fn run<const J: usize>(
    plant: &Plant<J>,
    effects: PlantEffects,
    start: &MotionStart<J>,
    drive: &MotorInput<J>,
    settings: &Settings<J>,
) -> Result<SimulatedRun<J>, SimulateError> {
    settings.samples(true)?;
    let whole = &mut |_: &mut SimulatedRun<J>| Ok(());
    let (mut run, effects) = run_in_blocks(plant, effects, start, drive, settings, None, whole)?;
    let mut recorder = LogRecorder::new(&settings.sensors, settings.seed);
    recorder.hear(&run);
    recorder.measure(&mut run, &plant.mechanism, &effects);
    Ok(run)
}

/// Takes the rows of a block, before noise and faults; they are forgotten behind it.
pub(super) type HandOn<'a, const J: usize> =
    &'a mut dyn FnMut(&mut SimulatedRun<J>) -> Result<(), SimulateError>;

/// Runs as [`run`] does without noise, faults and losses, hands every `block` rows on and gives back the last.
pub(super) fn run_in_blocks<const J: usize>(
    plant: &Plant<J>,
    effects: PlantEffects,
    start: &MotionStart<J>,
    drive: &MotorInput<J>,
    settings: &Settings<J>,
    block: Option<usize>,
    hand_on: HandOn<J>,
) -> Result<(SimulatedRun<J>, PlantEffects), SimulateError> {
    settings.check()?;
    if let MotorInput::Follow { reference, control } = drive {
        reference.path.check()?;
        control.check()?;
    }
    let moving = MovingPlant {
        plant,
        effects,
        volts: [0.0; J],
    };
    let states = moving.effects.states();
    macro_rules! march_with {
        ($($size:literal)*) => {$(
            if const { compiled(J, $size) } && 2 * J + states <= $size {
                return march::<J, $size>(moving, start, drive, settings, block, hand_on);
            }
        )*};
    }
    march_with!(2 8 16 32 64 128);
    let most = sizes(J)[3] - 2 * J;
    Err(SimulateError::TooManyStates { states, most })
}

fn march<const J: usize, const N: usize>(
    mut moving: MovingPlant<J>,
    start: &MotionStart<J>,
    drive: &MotorInput<J>,
    settings: &Settings<J>,
    block: Option<usize>,
    hand_on: HandOn<J>,
) -> Result<(SimulatedRun<J>, PlantEffects), SimulateError> {
    let mechanism = &moving.plant.mechanism;
    let samples = settings.samples(false)?;
    let block = block.unwrap_or(samples);
    let sensors = &settings.sensors;
    let mut instants = sensors.instants(settings.rate_hz, settings.seed);
    let mut recording = SimulatedRun::empty(mechanism, samples.min(block));
    let mut integrator = DormandPrince::new(settings.tolerance);
    let mut y = initial_state::<J, N>(&mut moving, start, drive, settings)?;
    let mut memory = None;
    let mut t = instants.next().unwrap_or(0.0);
    for k in 0..samples {
        let (q, v) = (part::<J, N>(&y, 0), part::<J, N>(&y, J));
        let at_links = mechanism.coordinates(&q);
        let beyond = limits_reached(mechanism, t, &at_links, &mut recording)?;
        let (motors, _) = moving.motor_side(&q, &v, &y[2 * J..]);
        let coordinates = mechanism.coordinates(&motors);
        let seen = sensors.encoders(&coordinates, &mechanism.resolution);
        let (wanted, asked) = match drive {
            MotorInput::Follow { reference, control } => {
                let target = wanted(mechanism, reference, t);
                let volts = control.volts(&mut memory, t, &seen, &target);
                (target.position, volts)
            }
            MotorInput::Volts(series) => (coordinates, series.at(t)),
        };
        let limit = settings.saturation;
        moving.volts = asked.map(|u| u.clamp(-limit, limit));
        let measured = mechanism.pose(&seen).unwrap_or(motors);
        recording.t.push(t);
        recording.x.push(seen);
        recording.volts.push(moving.volts);
        recording.q.push(measured);
        let logged = mechanism.torque(&measured, &moving.volts);
        recording.torque.push(logged);
        let status = |i: usize| match beyond[i] {
            true => MotorStatus::LimitReached,
            false if asked[i].abs() >= limit => MotorStatus::Saturated,
            false => MotorStatus::Running,
        };
        recording.status.push(std::array::from_fn(status));
        let actual = &mut recording.actual;
        actual.q.push(q);
        actual.v.push(v);
        actual.torque.push(mechanism.torque(&motors, &moving.volts));
        actual.a.push(moving.acceleration(t, &y));
        actual.target.push(wanted);
        if beyond.contains(&true) {
            recording.ending = RunEnding::StoppedAtLimit;
            break;
        }
        if k + 1 < samples {
            let next = instants.next().unwrap_or(t);
            integrator.advance(&mut moving, t, next, &mut y)?;
            t = next;
            if recording.rows() == block {
                hand_on(&mut recording)?;
                recording.clear();
            }
        }
    }
    Ok((recording, moving.effects))
}

/// Target of a reference in motor coordinates.
fn wanted<const J: usize>(mechanism: &Mechanism<J>, reference: &Reference<J>, t: f64) -> Target<J> {
    let target = reference.path.at(t);
    match reference.frame {
        ReferenceFrame::Motors => target,
        ReferenceFrame::Joints => Target {
            position: mechanism.coordinates(&target.position),
            velocity: mechanism.coordinate_speeds(&target.position, &target.velocity),
        },
    }
}

/// Marks the coordinates that are at x beyond their limits, and notes where.
fn limits_reached<const J: usize>(
    mechanism: &Mechanism<J>,
    t: f64,
    x: &[f64; J],
    recording: &mut SimulatedRun<J>,
) -> Result<[bool; J], SimulateError> {
    let (lower, upper) = (&mechanism.lower, &mechanism.upper);
    let beyond: [bool; J] = std::array::from_fn(|i| !(lower[i]..=upper[i]).contains(&x[i]));
    if beyond.contains(&true) && x.iter().any(|x| !x.is_finite()) {
        return Err(SimulateError::Diverged { t });
    }
    let reached = (0..J).filter(|&i| beyond[i]).map(|i| LimitEvent {
        coordinate: recording.coordinates[i].clone(),
        t,
        value: x[i],
        lower: lower[i],
        upper: upper[i],
    });
    recording.limits.extend(reached);
    Ok(beyond)
}

/// Joint positions, speeds and effect states at t = 0.
fn initial_state<const J: usize, const N: usize>(
    moving: &mut MovingPlant<J>,
    start: &MotionStart<J>,
    drive: &MotorInput<J>,
    settings: &Settings<J>,
) -> Result<[f64; N], SimulateError> {
    let mechanism = &moving.plant.mechanism;
    let (lower, upper) = (&mechanism.lower, &mechanism.upper);
    let (x, q, v) = match (start, drive) {
        (MotionStart::State { position, speed }, _) => {
            let q = mechanism.pose(position)?;
            (*position, q, mechanism.joint_speeds(&q, speed)?)
        }
        (MotionStart::Settled, MotorInput::Volts(_)) => {
            let middle = std::array::from_fn(|i| {
                let middle = 0.5 * (lower[i] + upper[i]);
                if middle.is_finite() { middle } else { 0.0 }
            });
            (middle, mechanism.pose(&middle)?, [0.0; J])
        }
        (MotionStart::Settled, MotorInput::Follow { reference, control }) => {
            let target = wanted(mechanism, reference, 0.0);
            settle(moving, &target, control)?
        }
    };
    if let Some(i) = (0..J).find(|&i| !(lower[i]..=upper[i]).contains(&x[i])) {
        return Err(mechanism.beyond_at_start(i, x[i]));
    }
    let mut y = [0.0; N];
    y[..J].copy_from_slice(&q);
    y[J..2 * J].copy_from_slice(&v);
    if !moving.effects.is_empty() {
        let load = moving.load(0.0, &q, &v, &y[2 * J..]);
        let n = mechanism.joints();
        let beginning = InitialCondition {
            q: &q[..n],
            load: &load[..n],
            seconds: settings.seconds,
            seed: settings.seed,
        };
        moving.effects.begin(&beginning, &mut y[2 * J..]);
        // The pose is that of the motors; elastic links hang beside it.
        let hanging: [f64; J] = moving.motor_side(&[0.0; J], &[0.0; J], &y[2 * J..]).0;
        for (q, beyond) in y.iter_mut().zip(hanging) {
            *q -= beyond;
        }
    }
    Ok(y)
}

/// Position in motor coordinates, joint positions and joint speeds.
type Pose<const J: usize> = ([f64; J], [f64; J], [f64; J]);

/// Pose beside the target from which the controller's volts carry the load: kp (x_d - x) = u(x).
fn settle<const J: usize>(
    moving: &MovingPlant<J>,
    target: &Target<J>,
    control: &ControllerSettings<J>,
) -> Result<Pose<J>, SimulateError> {
    let mechanism = &moving.plant.mechanism;
    let (lower, upper) = (&mechanism.lower, &mechanism.upper);
    let rest = vec![0.0; moving.effects.states()];
    let mut x = target.position;
    let mut q = mechanism.pose(&x)?;
    let mut v = mechanism.joint_speeds(&q, &target.velocity)?;
    // The load changes little over the displacement: a few rounds converge to rounding.
    for _ in 0..8 {
        let volts = mechanism.volts(&q, &moving.holding_torque(0.0, &q, &v, &rest))?;
        for i in 0..J {
            x[i] = target.position[i] - volts[i] / control.proportional[i];
            // A target inside the limits stays a start inside the limits.
            if (lower[i]..=upper[i]).contains(&target.position[i]) {
                x[i] = x[i].clamp(lower[i], upper[i]);
            }
        }
        q = mechanism.pose(&x)?;
        v = mechanism.joint_speeds(&q, &target.velocity)?;
    }
    Ok((x, q, v))
}
