//! Where a joint stands or turns: static friction takes any torque up to its level there, and no law of the speed
//! says which.
//!
//! tau = Y theta + F(v) holds sample by sample, so it holds as well with both sides times a weight, before the parallel
//! filter as behind it. The weight of a joint is 0 where it stands or turns and 1 where it moves, and it rises over the
//! response of the position filter, within which the speed near a standstill is not known. So neither a stick nor what
//! the filters make of one reaches a row, and the rows beside it stay. To leave out every row that the parallel filter
//! reaches from a standstill instead costs a quarter of the rows, and less than that leaves a bias of ten standard
//! deviations.

/// Share of movement in what the parallel filter lets through below which a row is one of rest.
const RESTING: f64 = 0.25;

/// 1 where a joint moves, 0 where it rests: a channel to filter like the torque. A `rest_speed` below 0 is of a
/// joint that never rests.
#[inline]
pub fn movement(v: f64, rest_speed: f64) -> f64 {
    f64::from(u8::from(v.abs() > rest_speed))
}

/// Whether a row is one of rest, from its filtered channel of [`movement`].
#[inline]
pub fn rests(filtered: f64) -> bool {
    filtered < RESTING
}

/// Writes the weight of every sample of a joint whose speeds are `v` and that rests up to `rest_speed`; all are 1 where
/// that is below 0. `reach` is the position filter's response in samples. Of several joints side by side each is every
/// `joints`-th value, from `joint` on.
pub fn weigh(
    v: &[f64],
    (joints, joint): (usize, usize),
    rest_speed: f64,
    reach: usize,
    out: &mut [f64],
) {
    let speeds = || v.iter().skip(joint).step_by(joints);
    let width = (2 * reach + 1) as f64;
    // whether it stands, or has turned since the sample before
    let mut before = 0.0;
    let mut since = usize::MAX;
    for (v, out) in speeds().zip(out.iter_mut().skip(joint).step_by(joints)) {
        let stands = v.abs() <= rest_speed || (rest_speed >= 0.0 && v * before < 0.0);
        since = if stands { 0 } else { since.saturating_add(1) };
        before = *v;
        *out = since as f64;
    }
    let mut until = f64::INFINITY;
    let backward = out.iter_mut().skip(joint).step_by(joints).rev();
    for out in backward {
        until = if *out == 0.0 { 0.0 } else { until + 1.0 };
        let x = (until.min(*out) / width).min(1.0);
        *out = x - (std::f64::consts::TAU * x).sin() / std::f64::consts::TAU;
    }
}

/// Samples over which a position filter and differences over so many to each side answer to one sample.
pub(super) fn response(cutoff_hz: Option<f64>, dt: f64, differences: usize) -> usize {
    let of_filter = cutoff_hz.map_or(0, |hz| (1.0 / (hz * dt)).round() as usize);
    of_filter.max(differences)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_joint_has_no_weight_where_it_stands_or_turns_and_all_of_it_beyond_the_filters_response() {
        // two joints side by side: one turns between samples 9 and 10, the other never
        let v: Vec<f64> = (0..40).flat_map(|k| [9.5 - f64::from(k), 1.0]).collect();
        let mut out = vec![f64::NAN; 80];
        weigh(&v, (2, 0), 0.1, 3, &mut out);
        weigh(&v, (2, 1), 0.1, 3, &mut out);
        assert!(out.iter().skip(1).step_by(2).all(|w| *w == 1.0));
        let turns: Vec<f64> = out.iter().step_by(2).copied().collect();
        assert_eq!(turns[10], 0.0);
        for (k, w) in turns.iter().enumerate() {
            assert_eq!(*w == 1.0, k.abs_diff(10) >= 7, "{k}");
        }
        assert!(turns[..=10].is_sorted_by(|a, b| a >= b) && turns[10..].is_sorted());
    }

    #[test]
    fn a_joint_without_friction_never_rests() {
        let mut out = [0.0; 3];
        weigh(&[0.0, 1.0, -1.0], (1, 0), -1.0, 4, &mut out);
        assert_eq!(out, [1.0; 3]);
    }
}
