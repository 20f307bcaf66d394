//! How often 95 % intervals hold the truth.

use crate::sensor::Sensor;
use cft_ident_tool::tool::{ToolResult, analyse};

const DRAWS: u64 = 100;

/// Draws whose interval holds the truth, of some numbers.
fn share(sensor: &Sensor, names: &[(&str, f64)]) -> Vec<u64> {
    let mut inside = vec![0; names.len()];
    for seed in 0..DRAWS {
        let found: ToolResult = analyse(&sensor.log(1000 + seed), None).unwrap();
        for ((name, truth), inside) in names.iter().zip(&mut inside) {
            let of = found.parameters.iter().find(|p| p.name == *name).unwrap();
            let [low, high] = of.interval_95.unwrap();
            *inside += u64::from(low <= *truth && *truth <= high);
        }
    }
    inside
}

/// Of 100 draws 95 % are 88 to 99 in all but one of a thousand.
fn is_true(inside: &[u64]) -> bool {
    inside.iter().all(|count| (88..=DRAWS).contains(count))
}

#[test]
fn intervals_of_mass_and_centre_hold_the_truth() {
    let sensor = Sensor {
        poses: 48,
        ..Sensor::default()
    };
    let [x, y, z] = sensor.centre;
    let names = [("mass", sensor.mass), ("cx", x), ("cy", y), ("cz", z)];
    let shares = share(&sensor, &names);
    assert!(is_true(&shares), "{shares:?}");
}

#[test]
fn a_bias_that_drifts_does_not_spoil_the_interval_of_the_mass() {
    let sensor = Sensor {
        drift: [1.5, -1.0, 0.8],
        ..Sensor::default()
    };
    let shares = share(&sensor, &[("mass", sensor.mass), ("cz", sensor.centre[2])]);
    assert!(is_true(&shares), "{shares:?}");
}
