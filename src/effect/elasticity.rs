//! `elasticity`: a drive that gives way by torque / stiffness. The link lags the encoder, so that the
//! second derivative of the transmitted torque enters with the joint's inertia:
//! -(M_jj / stiffness) d2(tau_hat)/dt2, the first term of the flexible joint's expansion (Spong 1987).

use super::{Family, Key, Kind, Role, Scene, Unit, every_joint, no_limits, no_shape};

pub const KIND: Kind = Kind {
    name: "elasticity",
    family: Family::Timing,
    role: Role::Columns,
    shape: &[],
    linear: &[Key::new("compliance", Unit::Text("position per torque"))],
    places: every_joint,
    starts: no_shape,
    limits: no_limits,
    columns: |scene, place, _, _, out| {
        let Some(j) = place.joint() else { return };
        let inertia = inertia(scene, j);
        let load = &scene.load[j];
        let step = scene.stretch.dt;
        for k in 1..load.len().saturating_sub(1) {
            let second = (load[k + 1] - 2.0 * load[k] + load[k - 1]) / (step * step);
            out[0][k] = -inertia * second;
        }
    },
    separate_by: "reversals with high jerk at two poses of different inertia: the ringing keeps its \
                  frequency at any speed",
};

/// M_jj in the middle of the stretch: the column of a unit acceleration less that of none.
fn inertia(scene: &Scene, j: usize) -> f64 {
    let n = scene.robot.joints();
    let p = scene.theta.len();
    let k = scene.len() / 2;
    let (mut q, mut v, mut a) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    scene.stretch.at(k, &mut q, &mut v, &mut a);
    v.fill(0.0);
    a.fill(0.0);
    let mut y = vec![0.0; n * p];
    let mut torque = |a: &[f64]| {
        scene.robot.regressor(&q, &v, a, &mut y);
        let row = &y[j * p..(j + 1) * p];
        row.iter().zip(scene.theta).map(|(y, t)| y * t).sum::<f64>()
    };
    let rest = torque(&a);
    a[j] = 1.0;
    torque(&a) - rest
}
