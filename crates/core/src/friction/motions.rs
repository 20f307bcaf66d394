//! A one-joint log in memory, smoothed: what `prepare` starts from.
//!
//! The filter passes over a log many times, so its samples stay in memory (40 bytes per joint and sample);
//! a one-joint experiment lasts seconds to minutes. Commands refuse logs beyond their limit.

use super::prepare::SmoothedMotion;
use crate::motion::{self, FilterSettings, MotionError};

/// Smooths the positions of all joints of a log (`q`, `tau` row-major, samples x joints) on every
/// stretch between gaps. The ends of a stretch, where the smoothing filter has nothing to look
/// ahead to, are left off.
///
/// # Errors
/// [`MotionError`] for time that does not increase, or no stretch that is long enough.
pub fn motions(
    t: &[f64],
    q: &[f64],
    tau: &[f64],
    joints: usize,
    settings: &FilterSettings,
) -> Result<Vec<SmoothedMotion>, MotionError> {
    let n = joints;
    let mut out = Vec::new();
    let mut longest = 0;
    let stretches = motion::segments(t, settings)?;
    for stretch in &stretches {
        longest = longest.max(stretch.len());
        let rows = stretch.start * n..stretch.end * n;
        let Ok(smooth) = motion::full_rate(&t[stretch.clone()], &q[rows], n, settings) else {
            continue;
        };
        let kept = smooth.settled.clone();
        if kept.len() < 3 {
            continue;
        }
        let (from, to) = (stretch.start + kept.start, stretch.start + kept.end);
        let rows = kept.start * n..kept.end * n;
        out.push(SmoothedMotion {
            t: t[from..to].to_vec(),
            measured: q[from * n..to * n].to_vec(),
            q: smooth.q[rows.clone()].to_vec(),
            v: smooth.v[rows.clone()].to_vec(),
            a: smooth.a[rows].to_vec(),
            tau: tau[from * n..to * n].to_vec(),
        });
    }
    if out.is_empty() {
        return Err(MotionError::NoSegment {
            segments: stretches.len(),
            longest,
            needed: 100,
        });
    }
    Ok(out)
}
