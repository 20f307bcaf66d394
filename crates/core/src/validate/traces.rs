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

/// Of every four points keeps the two whose error over the joints is smallest and largest; stretches keep their borders.
fn halve(traces: &mut TorqueTraces, n: usize) {
    let mut out = TorqueTraces::default();
    let mut bounds = traces.breaks.clone();
    bounds.push(traces.t.len());
    for pair in bounds.windows(2) {
        out.breaks.push(out.t.len());
        for first in (pair[0]..pair[1]).step_by(4) {
            let four = first..(first + 4).min(pair[1]);
            let size = |i: &usize| -> f64 {
                let error = |j| traces.measured[i * n + j] - traces.reconstructed[i * n + j];
                (0..n).map(error).sum()
            };
            let low = four.clone().min_by(|a, b| size(a).total_cmp(&size(b)));
            let high = four.max_by(|a, b| size(a).total_cmp(&size(b)));
            let mut kept: Vec<usize> = low.into_iter().chain(high).collect();
            kept.sort_unstable();
            kept.dedup();
            for i in kept {
                let row = i * n..(i + 1) * n;
                out.t.push(traces.t[i]);
                out.measured.extend(&traces.measured[row.clone()]);
                out.reconstructed.extend(&traces.reconstructed[row]);
            }
        }
    }
    *traces = out;
}
