//! Effects on a serial robot: where they have a place, and a payload and a tilt against the same robot built
//! with them.

use cft_ident_core::effect::{Entry, PlaceRule};
use cft_ident_core::robot::Robot;
use cft_ident_core::robot::friction::ViscousCoulomb;
use cft_ident_core::robot::standard::{Body, STANDARD};
use cft_ident_files::config::RobotFile;
use cft_ident_plant::simulate::effects::RobotSites;
use cft_ident_plant::simulate::moving::MovingPlant;
use cft_ident_plant::simulate::{Mechanism, Plant, PlantEffects, SimulateError, SmoothFriction};

use super::missing::specs;

/// A turning joint, one that turns about a tilted axis, and a slide whose link also swings a dependent one.
fn robot(gravity: [f64; 3]) -> Robot {
    let text = format!(
        "[robot]\nmodel = \"serial\"\ndrive_inertia = false\ngravity = {gravity:?}\n\
         [[robot.link]]\njoint = \"first\"\n\
         [[robot.link]]\njoint = \"second\"\na = 0.4\nalpha = 0.6\n\
         [[robot.link]]\njoint = \"slide\"\nkind = \"prismatic\"\na = 0.2\nalpha = -1.2\n\
         [[robot.link]]\na = 0.1\nalpha = 0.8\n\
         follows = {{ offset = 0.3, linear = {{ second = -0.7 }}, \
         sine = [{{ amplitude = 0.4, phase = 0.2, of = {{ slide = 2.0, first = 0.5 }} }}] }}\n"
    );
    RobotFile::parse("robot.toml", &text)
        .expect("a robot")
        .robot()
}

/// Standard parameters of a body.
fn standard_of(mass: f64, centre: &[f64; 3], inertia: &[f64; 6]) -> [f64; STANDARD] {
    let (centre, inertia) = (*centre, *inertia);
    Body {
        mass,
        centre,
        inertia,
    }
    .standard()
}

fn standard(payload: [f64; STANDARD]) -> Vec<f64> {
    let mut links = [
        standard_of(
            4.0,
            &[0.18, 0.03, 0.02],
            &[0.03, 0.002, 0.0, 0.09, 0.001, 0.08],
        ),
        standard_of(
            2.5,
            &[0.09, -0.02, 0.01],
            &[0.02, 0.0, 0.001, 0.03, 0.0, 0.03],
        ),
        standard_of(
            1.5,
            &[0.02, 0.01, 0.06],
            &[0.01, 0.0, 0.0, 0.012, 0.0, 0.004],
        ),
        standard_of(
            0.8,
            &[0.05, 0.03, -0.02],
            &[0.01, 0.0, 0.0, 0.012, 0.0, 0.004],
        ),
    ];
    for (own, more) in links[3].iter_mut().zip(payload) {
        *own += more;
    }
    links.concat()
}

/// The robot with its last link carrying the payload.
fn truth(gravity: [f64; 3], payload: [f64; STANDARD]) -> Plant<3> {
    let robot = robot(gravity);
    let theta = robot.base_of(&standard(payload));
    let law = ViscousCoulomb {
        viscous: 2.0,
        coulomb: 1.0,
    };
    let mut mechanism = Mechanism::new(robot).expect("three joints");
    (mechanism.lower, mechanism.upper) = ([-1.0; 3], [1.0; 3]);
    // as steep with a payload as without
    let friction = |_, _| SmoothFriction::viscous_coulomb(law, 1.0);
    let plant = Plant::new(mechanism, &theta, friction, [0.0; 3]).expect("bodies");
    plant.check().expect("bodies");
    plant
}

fn built(truth: &Plant<3>, texts: &[&str]) -> Result<PlantEffects, SimulateError> {
    Ok(PlantEffects::build(&specs(texts), &RobotSites::of(truth)?)?.0)
}

/// Where an effect has a place, in the words of docs/developers/effects.md.
pub fn places(entry: &Entry) -> &'static str {
    let truth = truth([0.0, 0.0, -9.81], [0.0; STANDARD]);
    let fits = |text: &str| built(&truth, &[text]).is_ok();
    if entry.places == PlaceRule::Whole {
        return if fits(entry.name) { "whole" } else { "no" };
    }
    let [turns, slides] = ["second", "slide"].map(|joint| fits(&format!("{}:{joint}", entry.name)));
    match (turns, slides) {
        (true, true) => "joints",
        (true, false) => "turning",
        (false, true) => "sliding",
        (false, false) => "no",
    }
}

/// Largest difference of the accelerations of two plants over states, and the largest acceleration.
fn apart(one: &MovingPlant<3>, other: &MovingPlant<3>) -> (f64, f64) {
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for k in 0..50 {
        let y: [f64; 6] =
            std::array::from_fn(|i| (0.7 + f64::from(k) * (1.3 + i as f64)).sin() * 1.4);
        let (a, b) = (one.acceleration(0.0, &y), other.acceleration(0.0, &y));
        for (a, b) in a.into_iter().zip(b) {
            worst = worst.max((a - b).abs());
            largest = largest.max(b.abs());
        }
    }
    (worst, largest)
}

fn moving<'a>(truth: &'a Plant<3>, texts: &[&str]) -> MovingPlant<'a, 3> {
    MovingPlant {
        plant: truth,
        effects: built(truth, texts).expect("a place"),
        volts: [3.0, -2.0, 9.0],
    }
}

#[test]
fn a_payload_moves_a_serial_robot_as_if_its_last_link_were_heavier() {
    let gravity = [3.0, -9.0, -2.5];
    let bare = truth(gravity, [0.0; STANDARD]);
    let centre = [0.05, -0.1, 0.2];
    let extent = [0.02, 0.0, 0.0, 0.02, 0.0, 0.02];
    let loaded = truth(gravity, standard_of(1.3, &centre, &extent));
    let text = "payload:mass=1.3,mx=0.065,my=-0.13,mz=0.26,inertia=0.02";
    let (worst, largest) = apart(&moving(&bare, &[text]), &moving(&loaded, &[]));
    assert!(worst < 1e-10 * largest, "{worst:e} of {largest}");
    // and the plant without is another one
    let (far, _) = apart(&moving(&bare, &[]), &moving(&loaded, &[]));
    assert!(far > 0.05 * largest, "{far} of {largest}");
}

#[test]
fn tilted_gravity_moves_a_serial_robot_as_another_gravity_does() {
    let straight = truth([3.0, -9.0, -2.5], [0.0; STANDARD]);
    let askew = truth([3.2, -9.3, -2.5], [0.0; STANDARD]);
    let tilted = moving(&straight, &["gravity-tilt:gx=0.2,gy=-0.3"]);
    let (worst, largest) = apart(&tilted, &moving(&askew, &[]));
    assert!(worst < 1e-9 * largest, "{worst:e} of {largest}");
}

#[test]
fn what_a_serial_robot_cannot_carry_is_refused_with_the_way_out() {
    let truth = truth([0.0, 0.0, -9.81], [0.0; STANDARD]);
    let refused = |text: &str| built(&truth, &[text]).expect_err(text).to_string();
    assert!(refused("payload:mx=1").contains("mass is 0"));
    assert!(refused("payload:second").contains("leave the joint out"));
}

#[test]
fn what_the_diagnosis_looks_for_on_a_serial_robot_the_simulator_can_build() {
    let truth = truth([0.0, 0.0, -9.81], [0.0; STANDARD]);
    let robot = &truth.mechanism.robot;
    let laws = vec![cft_ident_core::robot::model::JointFriction::None; 3];
    let mut found = 0;
    for law in cft_ident_core::effect::LAWS {
        let sought = !law.places(robot, &laws).is_empty();
        let built = cft_ident_plant::simulate::effects::LAWS
            .iter()
            .find(|built| built.entry.name == law.entry.name)
            .expect("both rooms know it");
        if sought {
            found += 1;
            assert_ne!(places(built.entry), "no", "{}", law.entry.name);
            // what is found can be simulated: the same keys
            for key in law.key_names() {
                let known = built.entry.keys.iter().any(|k| k.name == key);
                assert!(known, "{}: {key}", law.entry.name);
            }
        }
    }
    assert!(found > 15, "{found}");
}
