//! Torques that are subtracted from a log: those of effects that a fit holds.

use crate::log::Block;
use cft_ident_core::motion::Stretch;

/// Torques along the stretches of one log [N or Nm].
#[derive(Debug, Clone, Default)]
pub struct TorqueCourse {
    pieces: Vec<Piece>,
}

/// Torques along one stretch, evenly spaced.
#[derive(Debug, Clone)]
struct Piece {
    begin: f64,
    dt: f64,
    /// `[joint][sample]`.
    torque: Vec<Vec<f64>>,
}

impl TorqueCourse {
    /// Adds the torques along a stretch, `[joint][sample]`.
    pub fn push(&mut self, stretch: &Stretch, torque: Vec<Vec<f64>>) {
        let begin = stretch.t.first().copied().unwrap_or(0.0);
        let dt = stretch.dt;
        self.pieces.push(Piece { begin, dt, torque });
    }

    /// Subtracts it from the torques of a block; before, between and behind the stretches what is nearest holds.
    pub(crate) fn subtract_from(&self, block: &mut Block) {
        let joints = block.joints();
        for (t, tau) in block.t.iter().zip(block.tau.chunks_mut(joints.max(1))) {
            let behind = self.pieces.partition_point(|p| p.begin <= *t);
            let nearest = match (behind.checked_sub(1), self.pieces.get(behind)) {
                (Some(before), Some(after)) => {
                    let closer = after.begin - t < t - self.pieces[before].end();
                    Some(if closer { behind } else { before })
                }
                (Some(before), None) => Some(before),
                (None, Some(_)) => Some(behind),
                (None, None) => None,
            };
            let Some(piece) = nearest.map(|i| &self.pieces[i]) else {
                return;
            };
            for (tau, held) in tau.iter_mut().zip(&piece.torque) {
                *tau -= piece.at(held, *t);
            }
        }
    }
}

impl Piece {
    fn end(&self) -> f64 {
        let samples = self.torque.first().map_or(0, Vec::len);
        self.begin + self.dt * samples.saturating_sub(1) as f64
    }

    /// Between samples along a line, beyond the ends as at the ends.
    fn at(&self, held: &[f64], t: f64) -> f64 {
        let last = held.len().saturating_sub(1);
        let place = ((t - self.begin) / self.dt).clamp(0.0, last as f64);
        let (from, part) = (place.floor() as usize, place.fract());
        let of = |k: usize| held.get(k.min(last)).copied().unwrap_or(0.0);
        of(from) * (1.0 - part) + of(from + 1) * part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_held_is_taken_off_each_row_by_its_time() {
        let stretch = |begin: f64| Stretch {
            dt: 0.5,
            t: (0..3).map(|k| begin + 0.5 * f64::from(k)).collect(),
            ..Stretch::default()
        };
        let mut held = TorqueCourse::default();
        held.push(&stretch(1.0), vec![vec![1.0, 2.0, 4.0], vec![0.0; 3]]);
        held.push(&stretch(10.0), vec![vec![8.0; 3], vec![1.0; 3]]);
        let t = vec![0.0, 1.0, 1.25, 2.0, 3.0, 9.0, 11.0];
        let mut block = Block {
            q: vec![0.0; 2 * t.len()],
            tau: vec![10.0; 2 * t.len()],
            t,
            ..Block::default()
        };
        held.subtract_from(&mut block);
        let of = |j: usize| {
            block
                .tau
                .iter()
                .skip(j)
                .step_by(2)
                .copied()
                .collect::<Vec<_>>()
        };
        assert_eq!(of(0), [9.0, 9.0, 8.5, 6.0, 6.0, 2.0, 2.0]);
        assert_eq!(of(1), [10.0, 10.0, 10.0, 10.0, 10.0, 9.0, 9.0]);
    }
}
