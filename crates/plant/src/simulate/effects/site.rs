//! Where effects sit: the joints of a robot, the screws of the CFT robot, the robot as a whole, with the
//! scales that default sizes are fractions of.

use crate::simulate::SimulateError;
use crate::simulate::plant::Plant;
use crate::simulate::temperature::PlantTemperatures;
use cft_ident_core::effect::EffectPlace;
use cft_ident_core::explain::ErrorText;
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::cft::geometry::L4;
use cft_ident_core::robot::cft::pantograph;

/// Middling speeds of a joint that slides \[m/s\] and of one that turns \[rad/s\].
const SLIDING_SPEED: f64 = 0.2;
const TURNING_SPEED: f64 = 0.5;
/// Middling speed of the screws' nuts \[m/s\].
const SCREW_SPEED: f64 = 0.05;
/// Rate at which a torque of [`EffectSite::scale`] against the speed brings the joint to rest \[1/s\]: steps of 0.3 ms stay stable.
const SIGN_RATE: f64 = 10_000.0;

/// What an effect is built for.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectSite {
    pub place: EffectPlace,
    /// Name of the joint or screw; empty for the robot as a whole.
    pub name: String,
    /// Whether it turns (orders are then per revolution) or slides (per metre).
    pub turns: bool,
    /// Typical friction, N or N m: what default sizes are a fraction of.
    pub scale: f64,
    /// Middling speed, m/s or rad/s.
    pub speed: f64,
    /// Inertia that the motor feels while the other joints are free to move, kg or kg m^2.
    pub inertia: f64,
    /// The least that it is in any pose, kg or kg m^2.
    pub least_inertia: f64,
    /// Lower and upper end of the travel, m or rad.
    pub travel: (f64, f64),
    /// Coulomb level of the friction law at speed, N or N m.
    pub coulomb: f64,
    /// Viscous coefficient of the friction law, N s/m or N m s/rad.
    pub viscous: f64,
}

impl EffectSite {
    /// Index of the joint; 0 where the place is none.
    pub fn joint(&self) -> usize {
        self.place.joint().unwrap_or(0)
    }

    /// Slope w of tanh(w v) where the definition has the sign of v, s/m or s/rad.
    pub fn slope(&self) -> f64 {
        // A joint without friction still needs a slope.
        SIGN_RATE * self.inertia / self.scale.max(1e-3 * self.inertia)
    }

    /// Middle of the travel, m or rad.
    pub fn middle(&self) -> f64 {
        0.5 * (self.travel.0 + self.travel.1)
    }

    /// Half of the travel, m or rad.
    pub(super) fn half_travel(&self) -> f64 {
        0.5 * (self.travel.1 - self.travel.0)
    }

    /// Refusal of a kind at this site.
    pub(super) fn refuse(&self, effect: &str, why: impl Into<ErrorText>) -> SimulateError {
        let place = match self.name.as_str() {
            "" => "this robot",
            name => name,
        };
        SimulateError::EffectPlace {
            effect: effect.to_owned(),
            place: place.to_owned(),
            why: why.into(),
        }
    }
}

/// The robot that effects are built for.
#[derive(Debug, Clone, Copy)]
pub struct PlantRobot<'a> {
    pub robot: &'a Robot,
    /// Its inertial parameters.
    pub theta: &'a [f64],
}

impl PlantRobot<'_> {
    /// Number of joints.
    pub fn joints(&self) -> usize {
        self.robot.joints()
    }

    /// The joint of a number, counted from one, that is another than `joint`.
    pub(super) fn other_joint(&self, joint: usize, number: f64) -> Option<usize> {
        (0..self.joints()).find(|&other| other != joint && (other + 1) as f64 == number)
    }
}

/// All places of one robot.
#[derive(Debug, Clone)]
pub struct RobotSites<'a> {
    pub machine: PlantRobot<'a>,
    pub joints: Vec<EffectSite>,
    pub screws: Vec<EffectSite>,
    pub whole: Vec<EffectSite>,
    /// How warm its drives are.
    pub temperatures: PlantTemperatures,
}

impl<'a> RobotSites<'a> {
    /// The places of a plant.
    ///
    /// # Errors
    /// [`SimulateError::Robot`] where the middle of the limits is no pose, and
    /// [`SimulateError::NotPositiveDefinite`].
    pub fn of<const J: usize>(plant: &'a Plant<J>) -> Result<Self, SimulateError> {
        let robot = &plant.mechanism.robot;
        let joints = match workspace(plant) {
            Some((middle, poses)) => joints_in(plant, &middle, &poses)?,
            None => joints(plant),
        };
        let screws = screws(plant, &joints)?;
        let whole = joints.first().map(|first| EffectSite {
            place: EffectPlace::All,
            name: String::new(),
            ..first.clone()
        });
        Ok(Self {
            machine: PlantRobot {
                robot,
                theta: plant.theta(),
            },
            joints,
            screws,
            whole: whole.into_iter().collect(),
            temperatures: PlantTemperatures::default(),
        })
    }
}

/// The joints of a robot whose workspace only its file knows, with their inertia in the middle of the travel.
fn joints<const J: usize>(plant: &Plant<J>) -> Vec<EffectSite> {
    let m = &plant.mechanism;
    // one joint alone has its inertia in every pose
    let (least, at, speed) = match m.joints() {
        1 => (1.0, 1.0, 0.2),
        _ => (0.3, 0.5, 0.5),
    };
    let site = |j: usize| EffectSite {
        scale: plant.laws[j].torque(at).abs(),
        inertia: plant.inertia[j],
        least_inertia: least * plant.inertia[j],
        travel: m.travel(j),
        ..joint(plant, j, speed)
    };
    (0..m.joints()).map(site).collect()
}

/// A joint with its friction at a middling speed, whose inertia and travel are still to be given.
fn joint<const J: usize>(plant: &Plant<J>, j: usize, speed: f64) -> EffectSite {
    let robot = &plant.mechanism.robot;
    let [coulomb, viscous] = plant.laws[j].levels();
    EffectSite {
        place: EffectPlace::Joint(j),
        name: robot.joint_names()[j].clone(),
        turns: plant.mechanism.turns(j),
        scale: plant.laws[j].torque(speed).abs(),
        speed,
        inertia: 0.0,
        least_inertia: 0.0,
        travel: (f64::INFINITY, f64::NEG_INFINITY),
        coulomb,
        viscous,
    }
}

/// Inertia felt by a motor that pushes along a direction of the joints at the motors' coordinates x, the others free.
fn felt<const J: usize>(
    plant: &Plant<J>,
    x: &[f64; J],
    direction: &[f64; J],
) -> Result<f64, SimulateError> {
    let (mass, _) = plant.rigid(&plant.mechanism.pose(x)?, &[0.0; J]);
    let answer = plant
        .solve(&mass, direction)
        .ok_or_else(|| SimulateError::NotPositiveDefinite { x: x.to_vec() })?;
    let speed: f64 = direction.iter().zip(answer).map(|(d, a)| d * a).sum();
    Ok(1.0 / speed)
}

/// The middle of the motors' coordinates and poses all over their limits, where the robot's workspace is known.
fn workspace<const J: usize>(plant: &Plant<J>) -> Option<([f64; J], Vec<[f64; J]>)> {
    const STEPS: usize = 4;
    const EACH: usize = STEPS + 1;
    let m = &plant.mechanism;
    let (limits, practice) = (m.robot.transmission().limits()?, m.practice.as_ref()?);
    let spans = limits.spans();
    let share = |i: usize, k: usize| limits.lower[i] + spans[i] * k as f64 / STEPS as f64;
    let matter: Vec<usize> = (0..m.joints()).filter(|i| *i != practice.uniform).collect();
    // corners and middles; a coordinate that changes nothing but its own position stays at both ends
    let poses = (0..EACH.pow(matter.len() as u32)).flat_map(|k| [(k, 0), (k, STEPS)]);
    let pose = |(mut rest, end): (usize, usize)| {
        let mut x = m.filled(|i| share(i, end));
        for &i in &matter {
            x[i] = share(i, rest % EACH);
            rest /= EACH;
        }
        x
    };
    Some((m.filled(|i| limits.middles()[i]), poses.map(pose).collect()))
}

/// The joints by the poses of their workspace: scales are the friction at a middling speed and the inertia in the middle.
fn joints_in<const J: usize>(
    plant: &Plant<J>,
    middle: &[f64; J],
    poses: &[[f64; J]],
) -> Result<Vec<EffectSite>, SimulateError> {
    let m = &plant.mechanism;
    let mut joints = Vec::with_capacity(m.joints());
    for j in 0..m.joints() {
        let mut direction = [0.0; J];
        direction[j] = 1.0;
        let speed = match m.turns(j) {
            true => TURNING_SPEED,
            false => SLIDING_SPEED,
        };
        let mut site = EffectSite {
            inertia: felt(plant, middle, &direction)?,
            least_inertia: f64::INFINITY,
            ..joint(plant, j, speed)
        };
        for x in poses {
            let felt = felt(plant, x, &direction)?;
            site.least_inertia = site.least_inertia.min(felt);
            let q = m.pose(x)?[j];
            site.travel = (site.travel.0.min(q), site.travel.1.max(q));
        }
        joints.push(site);
    }
    Ok(joints)
}

/// The screws of the pantograph.
fn screws<const J: usize>(
    plant: &Plant<J>,
    joints: &[EffectSite],
) -> Result<Vec<EffectSite>, SimulateError> {
    let m = &plant.mechanism;
    let mut screws = Vec::new();
    let Some(limits) = m.robot.transmission().limits() else {
        return Ok(screws);
    };
    let middle = m.filled(|i| limits.middles()[i]);
    let pose = m.pose(&middle)?;
    let Some(jacobian) = pose.first_chunk().map(pantograph::reference_jacobian) else {
        return Ok(screws);
    };
    for (row, name) in m.robot.transmission().screws().iter().enumerate() {
        let mut direction = [0.0; J];
        direction[2..4].copy_from_slice(&jacobian[row]);
        screws.push(EffectSite {
            place: EffectPlace::Actuator(row),
            name: (*name).to_owned(),
            turns: false,
            // A force on the crank of length L4 that takes the torque of the joint.
            scale: joints[3].scale / L4,
            speed: SCREW_SPEED,
            inertia: felt(plant, &middle, &direction)?,
            least_inertia: 0.0,
            travel: (-2.0 * L4, 2.0 * L4),
            coulomb: 0.0,
            viscous: 0.0,
        });
    }
    Ok(screws)
}
