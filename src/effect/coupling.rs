//! `coupling`: what another joint j does to joint i through shared gears or a linkage: viscous v_j,
//! coulomb sgn(v_i + r v_j), inertia a_j.

use super::{Family, Key, Kind, Place, Role, Unit, sign};

pub const KIND: Kind = Kind {
    name: "coupling",
    family: Family::Cross,
    role: Role::Columns,
    shape: &[Key::new("r", Unit::Text(""))],
    linear: &[
        Key::new("viscous", Unit::Viscous),
        Key::new("coulomb", Unit::Torque),
        Key::new("inertia", Unit::Inertia),
    ],
    places: |robot, _| {
        let n = robot.joints();
        let pairs = (0..n).flat_map(|on| (0..n).map(move |of| Place::Pair { on, of }));
        pairs
            .filter(|p| !matches!(p, Place::Pair { on, of } if on == of))
            .collect()
    },
    starts: |cover, place| match place {
        Place::Pair { of, .. } if cover.joints[of].reversals >= 2 => {
            Ok(vec![vec![1.0], vec![-1.0]])
        }
        _ => Err("the other joint reverses fewer than two times".into()),
    },
    limits: |_, _| vec![[-1.0, 1.0]],
    columns: |scene, place, shape, _, out| {
        let Place::Pair { on, of } = place else {
            return;
        };
        let s = scene.stretch;
        out[0].copy_from_slice(&s.v[of]);
        for (x, (a, b)) in out[1].iter_mut().zip(s.v[on].iter().zip(&s.v[of])) {
            *x = sign(a + shape[0] * b);
        }
        out[2].copy_from_slice(&s.a[of]);
    },
    separate_by: "move the other joint alone, both ways at several speeds",
};
