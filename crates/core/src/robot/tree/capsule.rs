//! Capsules: all that is within a radius of a straight piece, and how far two of them are apart.

use super::pose::{BASE, Frame};
use super::space::{Vector, add, dot, times, turn};

/// A capsule that is fixed to a link.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Capsule {
    /// Index of the link; `None` for the base.
    pub link: Option<usize>,
    /// Ends of the piece in the link's frame \[m\].
    pub ends: [Vector; 2],
    /// \[m\]
    pub radius: f64,
}

impl Capsule {
    /// Ends of the piece in the base frame \[m\] where the links' frames are `frames`.
    pub fn placed(&self, frames: &[Frame]) -> [Vector; 2] {
        let (rotation, origin) = self.link.map_or(BASE, |link| frames[link]);
        self.ends.map(|end| add(&origin, &turn(&rotation, &end)))
    }

    /// Distance of the surfaces of two capsules \[m\]; below 0 where they overlap.
    pub fn distance(&self, other: &Self, frames: &[Frame]) -> f64 {
        let apart = of_pieces(&self.placed(frames), &other.placed(frames));
        apart - self.radius - other.radius
    }
}

/// Least distance of two straight pieces \[m\] (Ericson 2005, Real-Time Collision Detection, section 5.1.9). A
/// piece without length is a point.
pub fn of_pieces(one: &[Vector; 2], other: &[Vector; 2]) -> f64 {
    let between = |to: &Vector, from: &Vector| add(to, &times(-1.0, from));
    let (d1, d2) = (between(&one[1], &one[0]), between(&other[1], &other[0]));
    let r = between(&one[0], &other[0]);
    let (a, e, f) = (dot(&d1, &d1), dot(&d2, &d2), dot(&d2, &r));
    let (b, c) = (dot(&d1, &d2), dot(&d1, &r));
    // lengths below a micrometre are none
    let (first, second) = (a > 1e-12, e > 1e-12);
    let share = |x: f64| x.clamp(0.0, 1.0);
    let (s, t) = match (first, second) {
        (false, false) => (0.0, 0.0),
        (false, true) => (0.0, share(f / e)),
        (true, false) => (share(-c / a), 0.0),
        (true, true) => {
            let crossed = a * e - b * b;
            // any point of parallel pieces will do, for t is found from it
            let s = match crossed > 1e-12 * a * e {
                true => share((b * f - c * e) / crossed),
                false => 0.0,
            };
            let t = (b * s + f) / e;
            match t {
                t if t < 0.0 => (share(-c / a), 0.0),
                t if t > 1.0 => (share((b - c) / a), 1.0),
                t => (s, t),
            }
        }
    };
    let gap = add(&r, &add(&times(s, &d1), &times(-t, &d2)));
    dot(&gap, &gap).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    /// Least distance over a grid of points of both, made finer about the nearest pair.
    fn searched(one: &[Vector; 2], other: &[Vector; 2]) -> f64 {
        let at = |piece: &[Vector; 2], s: f64| -> Vector {
            std::array::from_fn(|k| piece[0][k] + s * (piece[1][k] - piece[0][k]))
        };
        let (mut middle, mut half, mut least) = ((0.5, 0.5), 0.5, f64::INFINITY);
        for _ in 0..12 {
            let mut nearest = middle;
            for i in 0..=40 {
                for j in 0..=40 {
                    let of = |middle: f64, k: i32| {
                        (middle + half * (f64::from(k) / 20.0 - 1.0)).clamp(0.0, 1.0)
                    };
                    let (s, t) = (of(middle.0, i), of(middle.1, j));
                    let (p, q) = (at(one, s), at(other, t));
                    let d = (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
                    if d < least {
                        (least, nearest) = (d, (s, t));
                    }
                }
            }
            (middle, half) = (nearest, 0.25 * half);
        }
        least
    }

    #[test]
    fn distances_of_pieces_are_those_that_a_search_over_both_finds() {
        let mut chance = ChaCha8Rng::seed_from_u64(4);
        let mut number = || -> f64 { chance.random_range(-1.0..1.0) };
        for case in 0..300 {
            let mut point = || -> Vector { std::array::from_fn(|_| number()) };
            let (one, mut other) = ([point(), point()], [point(), point()]);
            let along: Vector = std::array::from_fn(|k| one[1][k] - one[0][k]);
            match case % 5 {
                // parallel, a point, one that meets it
                1 => other[1] = std::array::from_fn(|k| other[0][k] + 0.7 * along[k]),
                2 => other[1] = other[0],
                3 => other[0] = std::array::from_fn(|k| one[0][k] + 0.3 * along[k]),
                _ => {}
            }
            let (found, expected) = (of_pieces(&one, &other), searched(&one, &other));
            assert!(
                (found - expected).abs() < 1e-6,
                "{case}: {found} {expected}"
            );
            assert!((of_pieces(&other, &one) - found).abs() < 1e-12);
        }
    }
}
