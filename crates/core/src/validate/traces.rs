//! Traces of torques that stay short.

use super::TorqueTraces;

/// Most points of a trace; beyond it neighbouring pairs of extremes merge.
const MOST_POINTS: usize = 16_384;

/// Appends a row to the traces; thins them by two where they are too many.
pub(super) fn append(traces: &mut TorqueTraces, t: f64, filtered: &[f64], n: usize) {
    traces.t.push(t);
    traces.measured.extend_from_slice(&filtered[..n]);
    traces.reconstructed.extend_from_slice(&filtered[n..]);
    if traces.t.len() >= MOST_POINTS {
        halve(traces, n);
    }
}

/// Of every four points keeps the two whose first-joint error is smallest and largest, in order
/// of time; stretches keep their borders.
fn halve(traces: &mut TorqueTraces, n: usize) {
    let mut out = TorqueTraces::default();
    let mut bounds = traces.breaks.clone();
    bounds.push(traces.t.len());
    for pair in bounds.windows(2) {
        out.breaks.push(out.t.len());
        let mut k = pair[0];
        while k < pair[1] {
            let end = (k + 4).min(pair[1]);
            let size = |i: &usize| -> f64 {
                (0..n)
                    .map(|j| traces.measured[i * n + j] - traces.reconstructed[i * n + j])
                    .sum()
            };
            let lo = (k..end).min_by(|a, b| size(a).total_cmp(&size(b)));
            let hi = (k..end).max_by(|a, b| size(a).total_cmp(&size(b)));
            let (Some(lo), Some(hi)) = (lo, hi) else {
                break;
            };
            let mut kept = [lo.min(hi), lo.max(hi)].to_vec();
            kept.dedup();
            for i in kept {
                out.t.push(traces.t[i]);
                out.measured
                    .extend_from_slice(&traces.measured[i * n..(i + 1) * n]);
                out.reconstructed
                    .extend_from_slice(&traces.reconstructed[i * n..(i + 1) * n]);
            }
            k = end;
        }
    }
    *traces = out;
}
