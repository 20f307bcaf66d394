//! The experiment that separates an effect from its like, as a command to type: the motion is simulated
//! with the model, and `--reference` runs the same one on the robot.

use cft_ident_core::effect::{Added, Ladder, Place};
use cft_ident_core::robot::Robot;

/// A motion of one joint or motor alone, both ways at ten speeds over its range, where such a motion
/// separates the effect; none where it takes a payload, a standstill or other sensors.
pub fn separating_command(effect: &Added, robot: &Robot) -> Option<String> {
    let Ladder { seconds, travel } = effect.law.entry.ladder?;
    let travel = travel.map_or(String::new(), |share| format!(" --travel {share}"));
    let moves = match effect.place {
        // the other joint alone
        Place::Pair { of, .. } | Place::Geared { other: of, .. } => {
            robot.joint_names().get(of)?.clone()
        }
        Place::Joint(j) => robot.joint_names().get(j)?.clone(),
        // y_r hangs on the first motor, x_r on the second
        Place::Actuator(0) => "x_c2".to_owned(),
        Place::Actuator(_) => "x_c1".to_owned(),
        Place::All => return None,
    };
    Some(format!(
        "cft-ident simulate -r ROBOT.toml -m MODEL.toml --move {moves}{travel} --seconds {seconds} \
         -o separate.csv"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_core::effect::law;
    use cft_ident_core::robot::cft::{Setup, Structure};

    #[test]
    fn a_screw_is_moved_by_its_motor_and_a_coupling_by_the_other_joint() {
        let robot = Robot::cft(Setup::Tuedacs, Structure::Printed12);
        let told = |name: &str, place: Place| {
            let law = law(&robot, name).unwrap();
            let (shape, linear) = (vec![0.0; law.shape.len()], vec![0.0; law.linear.len()]);
            let effect = Added::new(law, place, shape, linear);
            separating_command(&effect, &robot)
        };
        let friction = told("actuator-friction", Place::Actuator(0)).unwrap();
        assert!(friction.contains("--move x_c2 "), "{friction}");
        let coupling = told("coupling", Place::Pair { on: 1, of: 3 }).unwrap();
        assert!(coupling.contains("--move q5 "), "{coupling}");
        let play = told("backlash", Place::Joint(0)).unwrap();
        assert!(play.contains("--move q1 --travel 0.1 "), "{play}");
        assert_eq!(told("delay", Place::All), None);
    }
}
