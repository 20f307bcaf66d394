//! What `lsq --static` says of poses that do not belong.

use std::fmt::Write;

use crate::log_folder::{ARM, run_line};

const MEASURED: &str = "torque_is = \"joint\"";

#[test]
fn a_held_pose_that_is_touched_is_named_by_the_fit_of_gravity() {
    let mut text = "t,q_a,q_b,tau_a,tau_b\n".to_owned();
    let mut before = [0.0; 2];
    for k in 0..40u32 {
        let at = f64::from(k);
        let q = [1.4 * (2.1 * at).sin(), 1.9 * (3.7 * at + 1.0).sin()];
        // friction of the way that each joint came
        let friction: [f64; 2] = std::array::from_fn(|j| match k {
            0 => 0.0,
            _ => [0.4, 0.2][j] * (q[j] - before[j]).signum(),
        });
        let fore = 9.81 * 0.5 * (q[0] + q[1]).cos();
        let noise = 0.02 * (7.3 * at).sin();
        let leans = if k == 20 { 3.0 } else { 0.0 };
        let tau_a = 9.81 * 1.6 * q[0].cos() + fore + friction[0] + noise + leans;
        let tau_b = fore + friction[1] - noise;
        writeln!(text, "{k},{:.5},{:.5},{tau_a:.5},{tau_b:.5}", q[0], q[1]).unwrap();
        before = q;
    }
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("poses.csv", &text);
    write("arm.toml", &format!("{ARM}\n[log]\n{MEASURED}\n"));
    let (code, found, said) = run_line(
        folder.path(),
        "lsq --static poses.csv -r arm.toml -o g.toml",
    );
    assert_eq!(code, 0, "{said}");
    let touched = found["touched"].as_array().unwrap();
    assert!(
        touched.len() == 1 && touched[0]["pose"] == 21,
        "{touched:?}"
    );
}
