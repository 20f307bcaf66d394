//! Friction from one-joint logs as laboratories have them.

#[path = "../../crates/studies/examples/study_one_joint/bench.rs"]
mod bench;

use bench::{ASKED, CASES, error_at_plateaus, estimated, off};

#[test]
fn the_curve_holds_at_every_plateau_and_a_second_term_is_taken_only_where_there_is_one() {
    for case in &CASES {
        let (found, law) = estimated(case, 0);
        let e = found.unwrap_or_else(|error| panic!("{}: {error}", case.name));
        let worst = error_at_plateaus(case, &e, &law);
        assert!(worst <= ASKED, "{}: off by {worst}", case.name);
        assert!(e.missed_plateaus().is_empty(), "{}", case.name);
        if case.one_slope {
            assert_eq!(e.coulomb_terms, 1, "{}", case.name);
            assert_eq!(e.law.coulomb_2, 0.0, "{}", case.name);
        }
        let beyond = e.curve_beyond.iter().map(|p| p.v.abs());
        let [_, fastest] = e.speeds.covered;
        assert!(beyond.clone().all(|v| v > fastest), "{}", case.name);
        // the band beyond is a forecast that holds where the law is the plant's
        for p in &e.curve_beyond {
            let error = (p.torque - law.torque(p.v)).abs();
            assert!(
                error <= 4.0 * p.std,
                "{}: {} at {}, relative {}",
                case.name,
                error / p.std,
                p.v,
                off(&e, &law, p.v)
            );
        }
    }
}
