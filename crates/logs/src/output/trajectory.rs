//! A motion as a controller takes it: a program in URScript.

use std::fmt::Write;

/// A motion of joints at a constant rate.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointTrajectory {
    /// What is to be known of it, line by line.
    pub notes: Vec<String>,
    /// Points a second \[Hz\].
    pub rate_hz: f64,
    /// Positions of every joint, point by point \[rad\].
    pub points: Vec<Vec<f64>>,
}

fn list(values: &[f64]) -> String {
    let all: Vec<String> = values.iter().map(|x| format!("{x:?}")).collect();
    format!("[{}]", all.join(", "))
}

impl JointTrajectory {
    fn comments(&self) -> String {
        self.notes
            .iter()
            .map(|line| format!("# {line}\n"))
            .collect()
    }

    /// A program in URScript: a slow move to the first point, then a target for each sample.
    pub fn urscript(&self) -> String {
        let mut out = self.comments();
        out.push_str("def cft_ident_motion():\n");
        if let Some(first) = self.points.first() {
            let _ = writeln!(out, "  movej({}, a=0.5, v=0.3)", list(first));
        }
        let step = format!("{:?}", 1.0 / self.rate_hz);
        for q in &self.points {
            let q = list(q);
            let _ = writeln!(
                out,
                "  servoj({q}, t={step}, lookahead_time=0.03, gain=500)"
            );
        }
        out.push_str("  stopj(1.0)\nend\n\ncft_ident_motion()\n");
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> JointTrajectory {
        JointTrajectory {
            notes: vec!["not checked: all".to_owned()],
            rate_hz: 125.0,
            points: (0..3).map(|k| vec![0.1 * f64::from(k), -1.0]).collect(),
        }
    }

    #[test]
    fn a_program_moves_slowly_to_the_first_point_and_ends_at_rest() {
        let text = two().urscript();
        let first = "  movej([0.0, -1.0], a=0.5, v=0.3)\n";
        assert!(text.contains(first), "{text}");
        assert_eq!(text.matches("servoj(").count(), 3);
        assert!(text.contains("t=0.008,"));
        assert!(text.contains("  stopj(1.0)\nend\n"));
    }
}
