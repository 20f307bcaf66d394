//! Faults that are put into a log: the plant does not know of them.

use cft_ident_plant::simulate::SimulatedRun;

use super::missing::noisy;

fn torque(recording: &SimulatedRun<4>, joint: usize) -> Vec<f64> {
    recording.torque.iter().map(|row| row[joint]).collect()
}

fn position(recording: &SimulatedRun<4>, joint: usize) -> Vec<f64> {
    recording.q.iter().map(|row| row[joint]).collect()
}

/// The sound log and the log with the fault; what the plant did is the same.
fn pair(text: &str) -> (SimulatedRun<4>, SimulatedRun<4>) {
    let (sound, spoilt) = (noisy(&[], 3), noisy(&[text], 3));
    assert_eq!(sound.actual, spoilt.actual, "{text}");
    assert_eq!(
        (&sound.x, &sound.volts, &sound.status),
        (&spoilt.x, &spoilt.volts, &spoilt.status)
    );
    (sound, spoilt)
}

/// The other joints' channels are untouched.
fn assert_others(sound: &SimulatedRun<4>, spoilt: &SimulatedRun<4>, joint: usize) {
    for other in (0..4).filter(|other| *other != joint) {
        assert_eq!(torque(sound, other), torque(spoilt, other));
        assert_eq!(position(sound, other), position(spoilt, other));
    }
}

#[test]
fn saturation_flattens_the_tops_and_quantisation_leaves_whole_steps() {
    let (sound, spoilt) = pair("saturation:q5:limit=12");
    assert_others(&sound, &spoilt, 3);
    let clipped: Vec<f64> = torque(&sound, 3)
        .iter()
        .map(|x| x.clamp(-12.0, 12.0))
        .collect();
    assert_eq!(torque(&spoilt, 3), clipped);
    assert!(clipped.iter().filter(|x| x.abs() == 12.0).count() > 100);

    let (sound, spoilt) = pair("quantisation:q2:step=0.25");
    assert_others(&sound, &spoilt, 1);
    for (clean, stepped) in torque(&sound, 1).iter().zip(torque(&spoilt, 1)) {
        assert_eq!(stepped % 0.25, 0.0);
        assert!((stepped - clean).abs() <= 0.125 * (1.0 + 1e-12));
    }
}

#[test]
fn a_stuck_channel_repeats_its_last_value_for_its_time() {
    for (text, is_torque) in [
        ("stuck-channel:q4:at=0.5005,seconds=0.4", true),
        ("stuck-channel:q4:at=0.5005,seconds=0.4,torque=0", false),
    ] {
        let (sound, spoilt) = pair(text);
        assert_others(&sound, &spoilt, 2);
        let channels = |r: &SimulatedRun<4>| [torque(r, 2), position(r, 2)];
        let ([t_a, q_a], [t_b, q_b]) = (channels(&sound), channels(&spoilt));
        let (a, b, same) = if is_torque {
            (t_a, t_b, q_a == q_b)
        } else {
            (q_a, q_b, t_a == t_b)
        };
        assert!(same);
        for (k, t) in sound.t.iter().enumerate() {
            let stuck = (0.5005..0.9005).contains(t);
            assert_eq!(b[k], if stuck { a[500] } else { a[k] }, "{t}");
        }
    }
}

#[test]
fn wrong_signs_and_orders_are_those_of_whole_channels() {
    let (sound, spoilt) = pair("wrong-sign-or-order:q1");
    assert_others(&sound, &spoilt, 0);
    let turned: Vec<f64> = torque(&sound, 0).iter().map(|x| -x).collect();
    assert_eq!(torque(&spoilt, 0), turned);

    let (sound, spoilt) = pair("wrong-sign-or-order:q4:swap=4");
    assert_eq!(torque(&spoilt, 2), torque(&sound, 3));
    assert_eq!(torque(&spoilt, 3), torque(&sound, 2));
    assert_eq!(sound.q, spoilt.q);
}

#[test]
fn a_filter_lags_like_its_differential_equation() {
    for (text, is_torque) in [
        ("filter:q5:cutoff=5", true),
        ("filter:q5:cutoff=5,torque=0", false),
    ] {
        let (sound, spoilt) = pair(text);
        assert_others(&sound, &spoilt, 3);
        let of = |r: &SimulatedRun<4>| {
            if is_torque {
                torque(r, 3)
            } else {
                position(r, 3)
            }
        };
        let (x, y) = (of(&sound), of(&spoilt));
        // The equation in a hundred small steps between two rows.
        let rate = std::f64::consts::TAU * 5.0;
        let mut state = x[0];
        let mut worst = 0.0_f64;
        for k in 1..x.len() {
            for part in 0..100 {
                let middle = x[k - 1] + (x[k] - x[k - 1]) * (f64::from(part) + 0.5) / 100.0;
                state += rate * 1e-5 * (middle - state) / (1.0 + 0.5 * rate * 1e-5);
            }
            worst = worst.max((state - y[k]).abs());
        }
        let span = x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        assert!(worst < 1e-7 * span, "{text}: {worst} of {span}");
        assert!(x.iter().zip(&y).any(|(x, y)| (x - y).abs() > 2e-3 * span));
    }
}

#[test]
fn a_late_log_shows_what_acted_before_and_an_early_one_what_will() {
    let clean = |texts: &[&str]| super::missing::table_3(texts);
    let sound = torque(&clean(&[]), 2);
    for (text, whole, share) in [
        ("delay:q4:d=0.005", 5_i64, 0.0),
        ("delay:q4:d=-0.003", -3, 0.0),
        ("delay:q4:d=0.0023", 2, 0.3),
    ] {
        let spoilt = torque(&clean(&[text]), 2);
        for k in 10..sound.len() as i64 - 10 {
            let before = |steps: i64| sound[(k - steps) as usize];
            let expected = (1.0 - share) * before(whole) + share * before(whole + 1);
            let found = spoilt[k as usize];
            assert!(
                (found - expected).abs() < 1e-8 * (1.0 + expected.abs()),
                "{text}, row {k}: {found} for {expected}"
            );
        }
    }
}

#[test]
fn a_delay_without_a_joint_is_common_to_all_and_noise_comes_after_it() {
    let (sound, spoilt) = (noisy(&[], 5), noisy(&["delay:d=0.004"], 5));
    assert_eq!(sound.torque_noise, spoilt.torque_noise);
    let clean = noisy(&["delay:d=0"], 5);
    for (late, own) in clean
        .torque
        .iter()
        .flatten()
        .zip(sound.torque.iter().flatten())
    {
        assert!((late - own).abs() < 1e-12 * (1.0 + own.abs()));
    }
    // The noise of both logs is the same; without it the one is the other four rows ago.
    let own = |k: usize, joint: usize| sound.torque[k][joint] - sound.actual.torque[k][joint];
    for k in 50..2000 {
        for joint in 0..4 {
            let late = spoilt.torque[k][joint] - own(k, joint);
            let then = sound.actual.torque[k - 4][joint];
            // Logged at the encoder's pose, which is a count beside the true one.
            assert!(
                (late - then).abs() < 0.02 * (1.0 + then.abs()),
                "{late}, {then}"
            );
        }
    }
}
