//! Rigid bodies on a chain of joints: inverse dynamics by Newton and Euler's recursion, the mass matrix by composite
//! bodies (Featherstone 2008, ch. 5 and 6). Every joint turns about, or slides along, the z axis of its frame.

use crate::space::{
    Matrix, Vector, about_z, add, back, cross, dot, of_point, of_rpy, product, scaled, sum, times,
    transposed,
};

/// Most joints of a plant.
pub const JOINTS: usize = 6;
/// One number per joint; those beyond the plant's own joints are zero.
pub type Joints = [f64; JOINTS];
/// Mass matrix; only the plant's own rows and columns are used.
pub type Square = [Joints; JOINTS];

/// A link with its joint.
#[derive(Debug, Clone)]
pub struct Link {
    /// Origin of the joint in the frame before it [m].
    pub xyz: Vector,
    /// Its roll, pitch and yaw [rad].
    pub rpy: Vector,
    pub slides: bool,
    /// Mass [kg].
    pub mass: f64,
    /// Centre of gravity in the link's frame [m].
    pub centre: Vector,
    /// Inertia about the centre of gravity [kg m^2].
    pub inertia: Matrix,
    /// Inertia of the drive, reckoned at the joint [kg m^2 or kg].
    pub drive_inertia: f64,
}

impl Link {
    /// This link with another body that is fixed to it, in the same frame.
    pub fn joined(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        let both = add(
            scaled(self.centre, self.mass),
            scaled(other.centre, other.mass),
        );
        let centre = scaled(both, 1.0 / mass);
        let about_centre = |body: &Self| {
            let away = add(body.centre, scaled(centre, -1.0));
            sum(&body.inertia, &of_point(body.mass, away))
        };
        Self {
            mass,
            centre,
            inertia: sum(&about_centre(self), &about_centre(other)),
            ..self.clone()
        }
    }
}

/// A chain with the acceleration of free fall in the frame of its base [m/s^2].
#[derive(Debug, Clone)]
pub struct Chain {
    pub links: Vec<Link>,
    pub gravity: Vector,
    turned: Vec<Matrix>,
}

/// Where a link stands in the frame before it.
struct Place {
    turn: Matrix,
    at: Vector,
}

const Z: Vector = [0.0, 0.0, 1.0];

impl Chain {
    pub fn new(links: Vec<Link>, gravity: Vector) -> Self {
        let turned = links.iter().map(|link| of_rpy(link.rpy)).collect();
        Self {
            links,
            gravity,
            turned,
        }
    }

    fn place(&self, i: usize, q: f64) -> Place {
        let (link, turned) = (&self.links[i], &self.turned[i]);
        if link.slides {
            let along = times(turned, scaled(Z, q));
            return Place {
                turn: *turned,
                at: add(link.xyz, along),
            };
        }
        Place {
            turn: product(turned, &about_z(q)),
            at: link.xyz,
        }
    }

    /// Torques that positions, speeds and accelerations need, without those of the drives' inertias.
    pub fn torque(&self, q: &Joints, v: &Joints, a: &Joints) -> Joints {
        let n = self.links.len();
        let (mut w, mut dw, mut acc) = ([0.0; 3], [0.0; 3], scaled(self.gravity, -1.0));
        let mut places: [Option<Place>; JOINTS] = Default::default();
        let (mut force, mut moment) = ([[0.0; 3]; JOINTS], [[0.0; 3]; JOINTS]);
        for i in 0..n {
            let (link, place) = (&self.links[i], self.place(i, q[i]));
            let at_joint = add(acc, add(cross(dw, place.at), cross(w, cross(w, place.at))));
            acc = back(&place.turn, at_joint);
            w = back(&place.turn, w);
            dw = back(&place.turn, dw);
            if link.slides {
                acc = add(acc, add(scaled(cross(w, Z), 2.0 * v[i]), scaled(Z, a[i])));
            } else {
                dw = add(dw, add(cross(w, scaled(Z, v[i])), scaled(Z, a[i])));
                w[2] += v[i];
            }
            let c = link.centre;
            let at_centre = add(acc, add(cross(dw, c), cross(w, cross(w, c))));
            force[i] = scaled(at_centre, link.mass);
            let spin = times(&link.inertia, w);
            moment[i] = add(
                add(times(&link.inertia, dw), cross(w, spin)),
                cross(c, force[i]),
            );
            places[i] = Some(place);
        }
        let mut tau = [0.0; JOINTS];
        for i in (0..n).rev() {
            tau[i] = if self.links[i].slides {
                force[i][2]
            } else {
                moment[i][2]
            };
            if let (Some(place), true) = (&places[i], i > 0) {
                let f = times(&place.turn, force[i]);
                force[i - 1] = add(force[i - 1], f);
                moment[i - 1] = add(
                    moment[i - 1],
                    add(times(&place.turn, moment[i]), cross(place.at, f)),
                );
            }
        }
        tau
    }

    /// The mass matrix without the drives' inertias.
    pub fn mass_matrix(&self, q: &Joints) -> Square {
        let n = self.links.len();
        let mut body: Vec<Body> = self.links.iter().map(Body::of).collect();
        let places: Vec<Place> = (0..n).map(|i| self.place(i, q[i])).collect();
        for i in (1..n).rev() {
            let moved = body[i].moved(&places[i]);
            body[i - 1] = body[i - 1].with(&moved);
        }
        let mut m = [[0.0; JOINTS]; JOINTS];
        for i in 0..n {
            let (mut f, mut t) = if self.links[i].slides {
                (scaled(Z, body[i].mass), cross(body[i].moment, Z))
            } else {
                (cross(Z, body[i].moment), times(&body[i].inertia, Z))
            };
            for j in (0..=i).rev() {
                let share = if self.links[j].slides { f[2] } else { t[2] };
                (m[i][j], m[j][i]) = (share, share);
                f = times(&places[j].turn, f);
                t = add(times(&places[j].turn, t), cross(places[j].at, f));
            }
        }
        m
    }

    /// Kinetic and potential energy, without the drives' [J].
    pub fn energy(&self, q: &Joints, v: &Joints) -> f64 {
        let m = self.mass_matrix(q);
        let n = self.links.len();
        let kinetic: f64 = (0..n)
            .map(|i| 0.5 * v[i] * (0..n).map(|j| m[i][j] * v[j]).sum::<f64>())
            .sum();
        let (mut turn, mut at) = ([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], Z], [0.0; 3]);
        let mut potential = 0.0;
        for (i, (link, &position)) in self.links.iter().zip(q).enumerate() {
            let place = self.place(i, position);
            at = add(at, times(&turn, place.at));
            turn = product(&turn, &place.turn);
            let centre = add(at, times(&turn, link.centre));
            potential -= link.mass * dot(self.gravity, centre);
        }
        kinetic + potential
    }
}

/// Mass, first moment and inertia about the origin of one frame.
struct Body {
    mass: f64,
    moment: Vector,
    inertia: Matrix,
}

impl Body {
    fn of(link: &Link) -> Self {
        Self {
            mass: link.mass,
            moment: scaled(link.centre, link.mass),
            inertia: sum(&link.inertia, &of_point(link.mass, link.centre)),
        }
    }

    /// The same body in the frame before.
    fn moved(&self, place: &Place) -> Self {
        let h = times(&place.turn, self.moment);
        let turned = product(
            &place.turn,
            &product(&self.inertia, &transposed(&place.turn)),
        );
        let p = place.at;
        let both = 2.0 * dot(h, p);
        let shift =
            |i: usize, j: usize| (if i == j { both } else { 0.0 }) - h[i] * p[j] - p[i] * h[j];
        let mixed = [0, 1, 2].map(|i| [0, 1, 2].map(|j| shift(i, j)));
        Self {
            mass: self.mass,
            moment: add(h, scaled(p, self.mass)),
            inertia: sum(&turned, &sum(&mixed, &of_point(self.mass, p))),
        }
    }

    fn with(&self, other: &Self) -> Self {
        Self {
            mass: self.mass + other.mass,
            moment: add(self.moment, other.moment),
            inertia: sum(&self.inertia, &other.inertia),
        }
    }
}

/// Ten standard parameters of a link about its frame's origin and the drive's inertia, by the names that model
/// files use: Ixx, Ixy, Ixz, Iyy, Iyz, Izz, mx, my, mz, m, Ia.
pub fn standard(link: &Link) -> [(&'static str, f64); 11] {
    let body = Body::of(link);
    let (i, h) = (body.inertia, body.moment);
    [
        ("Ixx", i[0][0]),
        ("Ixy", i[0][1]),
        ("Ixz", i[0][2]),
        ("Iyy", i[1][1]),
        ("Iyz", i[1][2]),
        ("Izz", i[2][2]),
        ("mx", h[0]),
        ("my", h[1]),
        ("mz", h[2]),
        ("m", body.mass),
        ("Ia", link.drive_inertia),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arms;

    fn poses() -> Vec<(Joints, Joints, Joints)> {
        let of = |k: f64| {
            let at = |s: f64| std::array::from_fn(|i| (k * s + 1.7 * i as f64 * s).sin());
            (at(1.0), at(2.3), at(3.1))
        };
        (1..8).map(|k| of(k as f64)).collect()
    }

    #[test]
    fn the_mass_matrix_of_composite_bodies_is_that_of_the_recursion() {
        for chain in [arms::arm3(), arms::arm6(), arms::scara()] {
            let n = chain.links.len();
            for (q, _, _) in poses() {
                let m = chain.mass_matrix(&q);
                let rest = chain.torque(&q, &[0.0; JOINTS], &[0.0; JOINTS]);
                for j in 0..n {
                    let mut a = [0.0; JOINTS];
                    a[j] = 1.0;
                    let tau = chain.torque(&q, &[0.0; JOINTS], &a);
                    for i in 0..n {
                        assert!((tau[i] - rest[i] - m[i][j]).abs() < 1e-12 * (1.0 + m[i][i]));
                    }
                }
            }
        }
    }

    #[test]
    fn two_bodies_on_a_link_have_the_sum_of_their_standard_parameters() {
        let links = arms::arm6().links;
        let (one, other) = (&links[2], &links[4]);
        let numbers = |link: &Link| standard(link).map(|(_, x)| x);
        let (a, b, both) = (numbers(one), numbers(other), numbers(&one.joined(other)));
        for k in 0..10 {
            assert!((a[k] + b[k] - both[k]).abs() < 1e-12, "{k}");
        }
        assert_eq!(both[10], a[10]);
    }

    #[test]
    fn the_power_of_the_torques_is_the_change_of_energy() {
        for chain in [arms::arm3(), arms::arm6(), arms::scara()] {
            for (q, v, a) in poses() {
                let h = 1e-5;
                let moved = |s: f64| {
                    let q: Joints = std::array::from_fn(|i| q[i] + s * v[i] + 0.5 * s * s * a[i]);
                    let v: Joints = std::array::from_fn(|i| v[i] + s * a[i]);
                    chain.energy(&q, &v)
                };
                let slope = (moved(h) - moved(-h)) / (2.0 * h);
                let tau = chain.torque(&q, &v, &a);
                let power: f64 = (0..chain.links.len()).map(|i| tau[i] * v[i]).sum();
                assert!(
                    (slope - power).abs() < 1e-6 * (1.0 + power.abs()),
                    "{slope} {power}"
                );
            }
        }
    }
}
