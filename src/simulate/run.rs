//! The experiment: sample, control, hold the volts, integrate to the next sample.

use super::SimulateError;
use super::controller::{Control, Controller};
use super::effects::{Beginning, Effects};
use super::integrate::DormandPrince;
use super::plant::{Moving, Plant, part};
use super::recording::{Ending, LimitEvent, Recording, Status};
use super::reference::{Frame, Reference, Target};
use super::settings::{OnLimit, Settings};
use super::volts::VoltSeries;

/// What drives the motors.
#[derive(Debug, Clone, PartialEq)]
pub enum Drive<const J: usize> {
    /// The controller follows a reference.
    Follow {
        reference: Reference<J>,
        control: Control<J>,
    },
    /// Volts are played back without looking at the robot.
    Volts(VoltSeries<J>),
}

/// Where the motion starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start<const J: usize> {
    /// On the reference, displaced by as much as the controller needs to carry the load at rest; in the
    /// middle of the limits, at rest, where no reference is followed.
    Settled,
    /// The initial conditions of the report's block: motor coordinates and their speeds.
    State { position: [f64; J], speed: [f64; J] },
}

/// State sizes that the integrator is compiled for: the smallest that holds the plant and its effects
/// is used.
const LARGEST: usize = 64;

/// Runs one experiment.
///
/// Reaching a limit is no error: see [`Recording::limits`] and [`Recording::ending`].
///
/// # Errors
/// [`SimulateError`] where the settings, reference or start cannot be used, or the motion diverges.
pub fn run<P: Plant<J>, const J: usize>(
    plant: &P,
    effects: Effects,
    start: &Start<J>,
    drive: &Drive<J>,
    settings: &Settings<J>,
) -> Result<Recording<J>, SimulateError> {
    settings.check()?;
    if let Drive::Follow { reference, control } = drive {
        reference.path.check()?;
        control.check()?;
    }
    let moving = Moving {
        plant,
        effects,
        volts: [0.0; J],
    };
    match 2 * J + moving.effects.states() {
        0..=2 => march::<P, J, 2>(moving, start, drive, settings),
        3..=8 => march::<P, J, 8>(moving, start, drive, settings),
        9..=16 => march::<P, J, 16>(moving, start, drive, settings),
        17..=LARGEST => march::<P, J, LARGEST>(moving, start, drive, settings),
        states => Err(SimulateError::TooManyStates {
            states: states - 2 * J,
            most: LARGEST - 2 * J,
        }),
    }
}

/// The drive with its memory.
enum Running<'a, const J: usize> {
    Follow(&'a Reference<J>, Controller<J>),
    Volts(&'a VoltSeries<J>),
}

fn march<P: Plant<J>, const J: usize, const N: usize>(
    mut moving: Moving<P, J>,
    start: &Start<J>,
    drive: &Drive<J>,
    settings: &Settings<J>,
) -> Result<Recording<J>, SimulateError> {
    let plant = moving.plant;
    let resolution = plant.resolution();
    let samples = (settings.seconds * settings.rate_hz).round().max(1.0) as usize;
    let instants = settings
        .sensors
        .instants(samples, settings.rate_hz, settings.seed);
    let mut recording = Recording::empty(plant, samples);
    let mut integrator = DormandPrince::new(settings.tolerance);
    let mut y = initial_state::<P, J, N>(&mut moving, start, drive, settings)?;
    let mut drive = match drive {
        Drive::Follow { reference, control } => {
            Running::Follow(reference, Controller::new(*control))
        }
        Drive::Volts(series) => Running::Volts(series),
    };
    for k in 0..samples {
        let t = instants[k];
        let beyond = limits_reached(&moving, settings.on_limit, t, &mut y, &mut recording)?;
        let (q, v) = (part::<J, N>(&y, 0), part::<J, N>(&y, J));
        let (motors, _) = moving.motor_side(&q, &v, &y[2 * J..]);
        let coordinates = plant.coordinates(&motors);
        let seen = settings.sensors.encoders(&coordinates, &resolution);
        let (wanted, asked) = match &mut drive {
            Running::Follow(reference, controller) => {
                let target = wanted(plant, reference, t)?;
                let volts = controller.volts(t, &seen, &target.position, &target.velocity);
                (target.position, volts)
            }
            Running::Volts(series) => (coordinates, series.at(t)),
        };
        let limit = settings.saturation;
        moving.volts = asked.map(|u| u.clamp(-limit, limit));
        recording.t.push(t);
        recording.x.push(seen);
        recording.volts.push(moving.volts);
        let measured = plant.joints(&seen).unwrap_or(motors);
        recording.q.push(measured);
        recording
            .torque
            .push(plant.torque(&measured, &moving.volts));
        recording.status.push(std::array::from_fn(|i| {
            if beyond[i] {
                Status::LimitReached
            } else if asked[i].abs() >= limit {
                Status::Saturated
            } else {
                Status::Running
            }
        }));
        recording.actual.q.push(q);
        recording.actual.v.push(v);
        recording
            .actual
            .torque
            .push(plant.torque(&motors, &moving.volts));
        recording.actual.a.push(moving.acceleration(t, &y));
        recording.actual.target.push(wanted);
        if beyond.contains(&true) && settings.on_limit == OnLimit::Stop {
            recording.ending = Ending::StoppedAtLimit;
            break;
        }
        if k + 1 < samples {
            integrator.advance(&mut moving, t, instants[k + 1], &mut y)?;
        }
    }
    recording.effort = integrator.effort();
    recording.measure(plant, &moving.effects, &settings.sensors, settings.seed);
    Ok(recording)
}

/// Target of a reference in motor coordinates.
fn wanted<P: Plant<J>, const J: usize>(
    plant: &P,
    reference: &Reference<J>,
    t: f64,
) -> Result<Target<J>, SimulateError> {
    let target = reference.path.at(t);
    Ok(match reference.frame {
        Frame::Motors => target,
        Frame::Joints => Target {
            position: plant.coordinates(&target.position),
            velocity: plant.coordinate_speeds(&target.position, &target.velocity),
        },
    })
}

/// Marks the coordinates beyond their limits, notes the first time of each, and clamps if asked to.
fn limits_reached<P: Plant<J>, const J: usize, const N: usize>(
    moving: &Moving<P, J>,
    on_limit: OnLimit,
    t: f64,
    y: &mut [f64; N],
    recording: &mut Recording<J>,
) -> Result<[bool; J], SimulateError> {
    let plant = moving.plant;
    let (lower, upper) = plant.limits();
    let mut q = part::<J, N>(y, 0);
    let mut x = plant.coordinates(&q);
    let beyond: [bool; J] = std::array::from_fn(|i| !(lower[i]..=upper[i]).contains(&x[i]));
    if !beyond.contains(&true) {
        return Ok(beyond);
    }
    if x.iter().any(|x| !x.is_finite()) {
        return Err(SimulateError::Diverged { t });
    }
    for i in (0..J).filter(|&i| beyond[i]) {
        let coordinate = &recording.coordinates[i];
        if !recording
            .limits
            .iter()
            .any(|event| event.coordinate == *coordinate)
        {
            recording.limits.push(LimitEvent {
                coordinate: coordinate.clone(),
                t,
                value: x[i],
                lower: lower[i],
                upper: upper[i],
            });
        }
        x[i] = x[i].clamp(lower[i], upper[i]);
    }
    if on_limit == OnLimit::Stop {
        return Ok(beyond);
    }
    q = plant.joints(&x)?;
    let mut v = part::<J, N>(y, J);
    let (mass, _) = plant.dynamics(&q, &v);
    // The stop pushes where the motor pushes: an impulse along motor i takes the outward speed away, and
    // what it does to the other coordinates follows from the inertia. Two rounds settle two stops.
    for i in (0..J).chain(0..J).filter(|&i| beyond[i]) {
        let speed = plant.coordinate_speeds(&q, &v)[i];
        let outward = if x[i] >= upper[i] {
            speed > 0.0
        } else {
            speed < 0.0
        };
        let mut push = [0.0; J];
        push[i] = 1.0;
        let Some(change) = plant.solve(&mass, &plant.torque(&q, &push)) else {
            continue;
        };
        let per_push = plant.coordinate_speeds(&q, &change)[i];
        if outward && per_push > 0.0 {
            for (v, change) in v.iter_mut().zip(change) {
                *v -= speed / per_push * change;
            }
        }
    }
    y[..J].copy_from_slice(&q);
    y[J..2 * J].copy_from_slice(&v);
    Ok(beyond)
}

/// Joint positions, speeds and effect states at t = 0.
fn initial_state<P: Plant<J>, const J: usize, const N: usize>(
    moving: &mut Moving<P, J>,
    start: &Start<J>,
    drive: &Drive<J>,
    settings: &Settings<J>,
) -> Result<[f64; N], SimulateError> {
    let plant = moving.plant;
    let (lower, upper) = plant.limits();
    let (x, q, v) = match (start, drive) {
        (Start::State { position, speed }, _) => {
            let q = plant.joints(position)?;
            (*position, q, plant.joint_speeds(&q, speed)?)
        }
        (Start::Settled, Drive::Volts(_)) => {
            let middle = std::array::from_fn(|i| {
                let middle = 0.5 * (lower[i] + upper[i]);
                if middle.is_finite() { middle } else { 0.0 }
            });
            (middle, plant.joints(&middle)?, [0.0; J])
        }
        (Start::Settled, Drive::Follow { reference, control }) => {
            let target = wanted(plant, reference, 0.0)?;
            settle(moving, &target, control)?
        }
    };
    for i in 0..J {
        if !(lower[i]..=upper[i]).contains(&x[i]) {
            return Err(SimulateError::LimitAtStart {
                coordinate: plant.coordinate_names()[i].clone(),
                value: x[i],
                lower: lower[i],
                upper: upper[i],
            });
        }
    }
    let mut y = [0.0; N];
    y[..J].copy_from_slice(&q);
    y[J..2 * J].copy_from_slice(&v);
    if !moving.effects.is_empty() {
        let load = moving.load(0.0, &q, &v, &y[2 * J..]);
        let beginning = Beginning {
            q: &q,
            load: &load,
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
fn settle<P: Plant<J>, const J: usize>(
    moving: &Moving<P, J>,
    target: &Target<J>,
    control: &Control<J>,
) -> Result<Pose<J>, SimulateError> {
    let plant = moving.plant;
    let (lower, upper) = plant.limits();
    let rest = vec![0.0; moving.effects.states()];
    let mut x = target.position;
    let mut q = plant.joints(&x)?;
    let mut v = plant.joint_speeds(&q, &target.velocity)?;
    // The load changes little over the displacement: a few rounds converge to rounding.
    for _ in 0..8 {
        let volts = plant.volts(&q, &moving.holding_torque(0.0, &q, &v, &rest))?;
        for i in 0..J {
            x[i] = target.position[i] - volts[i] / control.proportional[i];
            // A target inside the limits stays a start inside the limits.
            if (lower[i]..=upper[i]).contains(&target.position[i]) {
                x[i] = x[i].clamp(lower[i], upper[i]);
            }
        }
        q = plant.joints(&x)?;
        v = plant.joint_speeds(&q, &target.velocity)?;
    }
    Ok((x, q, v))
}
