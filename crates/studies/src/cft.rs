//! The CFT robot in its four joints q1 [m], q2, q4, q5 [rad]: mass matrix and gravity in twelve parameters, written from
//! its page of formulas; Coriolis terms by differences of the mass matrix (Christoffel's form).

use crate::chain::{JOINTS, Joints, Square};

const L4: f64 = 0.05;
const L6: f64 = 0.30;
const D: f64 = 0.0916;
const D6: f64 = 0.04;
/// L5 - L4 [m]
const U: f64 = 0.30;
const G: f64 = 9.81;
/// Width of the differences of the mass matrix [rad].
const WIDTH: f64 = 1e-4;

#[derive(Debug, Clone, PartialEq)]
pub struct Cft {
    /// theta_1 to theta_12.
    pub theta: [f64; 12],
}

impl Cft {
    pub fn mass_matrix(&self, q: &Joints) -> Square {
        let [t1, t2, t3, t4, t5, t6, t7, t8, t9, t10, t11, t12] = self.theta;
        let (s2, c2) = q[1].sin_cos();
        let (s4, c4) = q[2].sin_cos();
        let (s5, c5) = q[3].sin_cos();
        let (s, c) = (q[2] + q[3]).sin_cos();
        let mr = t11 + t12;
        let o = t2 + D6 * t11;
        let h0 = t3 + D * mr;
        let k = t4 + D * D * mr + D6 * D6 * t11;
        let (a, b) = (-(t5 + t7 + L6 * t12), -(t9 + U * mr));
        let (cc, e) = (-(t6 + t8), -t10);
        let aa = L6 * L6 * t12 - 2.0 * L4 * t5;
        let ab = U * (L6 * t12 + t7) - L4 * t5;
        let bb = U * U * mr - 2.0 * L4 * t9;
        let (ac, bc, be) = (-L4 * t6, U * t8 - L4 * t6, -L4 * t10);
        let h = h0 + a * s4 + b * s + cc * c4 + e * c;
        let h4 = a * c4 + b * c - cc * s4 - e * s;
        let h5 = b * c - e * s;
        let n = k
            + 2.0 * D * (h - h0)
            + aa * s4 * s4
            + bb * s * s
            + 2.0 * (ab * s4 * s + ac * s4 * c4 + bc * s * c4 + be * s * c);
        let r = bb + L4 * (L4 * mr - 2.0 * b) * s * s - 2.0 * L4 * e * s * c;
        let x = ab * c5 + bc * s5 + L4 * (L4 * mr - a - b) * s4 * s
            - L4 * e * s4 * c
            - L4 * cc * s * c4;
        let p = aa + L4 * (L4 * mr - 2.0 * a) * s4 * s4 - 2.0 * L4 * cc * s4 * c4;
        let turn = -D6 * U * t11 * c;
        let rows = [
            [t1 + mr, o * c2 - h * s2, h4 * c2, h5 * c2],
            [o * c2 - h * s2, n, -D6 * (t7 * c4 - t8 * s4) + turn, turn],
            [
                h4 * c2,
                -D6 * (t7 * c4 - t8 * s4) + turn,
                p + 2.0 * x + r,
                x + r,
            ],
            [h5 * c2, turn, x + r, r],
        ];
        let mut m = [[0.0; JOINTS]; JOINTS];
        for (whole, row) in m.iter_mut().zip(rows) {
            whole[..4].copy_from_slice(&row);
        }
        m
    }

    fn gravity(&self, q: &Joints) -> Joints {
        let [_, _, _, _, t5, t6, t7, t8, t9, t10, t11, t12] = self.theta;
        let ((s4, c4), (s, c)) = (q[2].sin_cos(), (q[2] + q[3]).sin_cos());
        let mr = t11 + t12;
        let (a, b) = (-(t5 + t7 + L6 * t12), -(t9 + U * mr));
        let (cc, e) = (-(t6 + t8), -t10);
        let shared = -(L4 * mr - b) * s + e * c;
        let mut g = [0.0; JOINTS];
        g[2] = G * (-(L4 * mr - a) * s4 + cc * c4 + shared);
        g[3] = G * shared;
        g
    }

    /// What remains of the torque without acceleration.
    pub fn bias(&self, q: &Joints, v: &Joints) -> Joints {
        let mut out = self.gravity(q);
        // the mass matrix does not depend on q1
        for k in 1..4 {
            let at = |way: f64| {
                let mut moved = *q;
                moved[k] += way * WIDTH;
                self.mass_matrix(&moved)
            };
            let (high, low) = (at(1.0), at(-1.0));
            let slope = |i: usize, j: usize| (high[i][j] - low[i][j]) / (2.0 * WIDTH);
            let mut power = 0.0;
            for (i, value) in out.iter_mut().enumerate().take(4) {
                let along: f64 = (0..4).map(|j| slope(i, j) * v[j]).sum();
                *value += along * v[k];
                power += 0.5 * v[i] * along;
            }
            out[k] -= power;
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn four(value: &Value) -> Joints {
        std::array::from_fn(|i| value[i].as_f64().unwrap_or(0.0))
    }

    #[test]
    fn the_model_gives_the_numbers_of_its_reference() {
        let text = include_str!("../../../fixtures/oracle/reference.json");
        let reference: Value = serde_json::from_str(text).unwrap();
        let theta = std::array::from_fn(|k| reference["theta"][k].as_f64().unwrap());
        let cft = Cft { theta };
        for state in reference["states"].as_array().unwrap() {
            let (q, v, a) = (four(&state["q"]), four(&state["v"]), four(&state["a"]));
            let m = cft.mass_matrix(&q);
            for (i, row) in m.iter().enumerate().take(4) {
                let expected = four(&state["M"][i]);
                assert!((0..4).all(|j| (row[j] - expected[j]).abs() < 1e-10), "{i}");
            }
            let (bias, tau, friction) = (cft.bias(&q, &v), four(&state["tau"]), four(&state["F"]));
            for i in 0..4 {
                let sum: f64 = bias[i] + (0..4).map(|j| m[i][j] * a[j]).sum::<f64>();
                assert!(
                    (sum + friction[i] - tau[i]).abs() < 1e-5,
                    "{i}: {sum} {}",
                    tau[i]
                );
            }
        }
    }
}
