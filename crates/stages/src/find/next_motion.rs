//! The next motion to record, as a command to type: one that narrows what is weak in a model, or separates an effect
//! from its like.

use cft_ident_core::effect::{EffectPlace, ModelEffect};
use cft_ident_core::number;
use cft_ident_core::robot::Robot;
use cft_ident_core::verdict::Verdict;
use cft_ident_files::config::ModelFile;
use cft_ident_files::config::model_file::Parameter;

/// A motion of one joint alone, both ways at several speeds, where such a motion separates the effect; none where it
/// takes a payload, a standstill, a motor alone or other sensors. `model` is the path as a shell takes it.
pub fn separating_command(effect: &ModelEffect, robot: &Robot, model: &str) -> Option<String> {
    effect.law.entry.ladder?;
    let joint = match effect.place {
        // the other joint alone
        EffectPlace::Pair { of, .. } | EffectPlace::Geared { other: of, .. } => of,
        EffectPlace::Joint(j) => j,
        EffectPlace::Actuator(_) | EffectPlace::Actuators | EffectPlace::All => return None,
    };
    let aim = format!("{}:{}", effect.name(), robot.joint_names().get(joint)?);
    // strokes are laid around the width of a memory; the file may not hold an effect that is not sure
    let numbers = effect.numbers(robot, "", None).into_iter();
    let numbers = numbers.filter(|n| effect.law.memory.is_some() && n.value != 0.0);
    let numbers = numbers.map(|n| format!("{}={}", n.key, number::significant(n.value, 3)));
    let numbers = numbers.collect::<Vec<_>>().join(",");
    Some(match numbers.as_str() {
        "" => command(model, &aim),
        numbers => command(model, &format!("{aim}:{numbers}")),
    })
}

/// A motion that narrows the parameters that are not identified, and how many of how many they are; none where every
/// one is, and where positions and speeds of the logs are not known. What the data say nothing of counts as little as
/// what no motion shows (a constant torque beside the weight of a slide): they look alike.
pub fn narrowing_command(file: &ModelFile, model: &str) -> Option<([usize; 2], String)> {
    let estimated = |p: &Parameter| {
        let mut own = file.estimates.iter();
        let own = own.find(|e| e.name == p.name && e.joint == p.joint);
        own.is_some_and(|e| e.std.is_some())
    };
    let rated = || file.parameters.iter().filter(|p| p.verdict.is_some());
    let open = |p: &&Parameter| {
        let weak = matches!(p.verdict, Some(Verdict::Weak | Verdict::NotIdentifiable));
        weak && (p.std.is_some() || estimated(p))
    };
    let open = rated().filter(open).count();
    let known = file.held_out.len() == file.robot.robot().joints();
    (open > 0 && known).then(|| ([open, rated().count()], command(model, "weak")))
}

fn command(model: &str, aim: &str) -> String {
    format!("cft-ident excite -m {model} --for {aim} -o next.toml")
}

#[cfg(test)]
mod tests {
    use super::*;
    use cft_ident_core::effect::law;
    use cft_ident_core::robot::cft::{LaboratorySetup, ParameterStructure};

    #[test]
    fn a_coupling_is_separated_by_the_other_joint_alone() {
        let robot = Robot::cft(LaboratorySetup::Tuedacs, ParameterStructure::Printed12);
        let of = |name: &str, place: EffectPlace| {
            let law = law(&robot, name).unwrap();
            let (shape, linear) = (vec![0.0; law.shape.len()], vec![0.0; law.linear.len()]);
            let effect = ModelEffect::new(law, place, shape, linear);
            separating_command(&effect, &robot, "m.toml")
        };
        let coupling = of("coupling", EffectPlace::Pair { on: 1, of: 3 }).unwrap();
        assert!(
            coupling.contains("-m m.toml --for coupling:q5 "),
            "{coupling}"
        );
        let play = of("backlash", EffectPlace::Joint(0)).unwrap();
        assert!(play.contains("--for backlash:q1 "), "{play}");
        assert_eq!(of("delay", EffectPlace::All), None);
    }
}
