//! Exported files, read as their readers do: the writers share no code with what stands here.
//!
//! | file | what |
//! |---|---|
//! | [`mechanism`] | bodies on joints, and the torques that they need |
//! | [`urdf`] | a URDF as a mechanism |
//! | [`mjcf`] | an MJCF as a mechanism, and its classes (`classes`) |

mod classes;
pub mod mechanism;
pub mod mjcf;
pub mod urdf;

use cft_ident_files::config::xml::Element;
use nalgebra::{Matrix3, Vector3};

/// Why a file is not what it should be.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
pub struct ReadError {
    pub problem: String,
}

impl ReadError {
    fn new(problem: impl Into<String>) -> Self {
        let problem = problem.into();
        Self { problem }
    }
}

/// The numbers of a text.
fn numbers(text: &str) -> Result<Vec<f64>, ReadError> {
    let each = text.split_whitespace().map(|word| {
        let number = word.parse::<f64>().ok().filter(|x| x.is_finite());
        number.ok_or_else(|| ReadError::new(format!("`{word}` is no number")))
    });
    each.collect()
}

/// The numbers of an attribute, as many as are wanted at most; `absent` fills up what is not given.
fn filled<const N: usize>(text: Option<&str>, absent: [f64; N]) -> Result<[f64; N], ReadError> {
    let mut out = absent;
    if let Some(text) = text {
        for (x, given) in out.iter_mut().zip(numbers(text)?) {
            *x = given;
        }
    }
    Ok(out)
}

fn named<'a>(element: &Element<'a, '_>, key: &str) -> Result<&'a str, ReadError> {
    element.attribute(key).ok_or_else(|| {
        let (name, line) = (element.name(), element.line());
        ReadError::new(format!("<{name}> of line {line} has no `{key}`"))
    })
}

/// Moments and products: xx, yy, zz, xy, xz, yz.
fn tensor([xx, yy, zz, xy, xz, yz]: [f64; 6]) -> Matrix3<f64> {
    Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
}

/// A direction of length 1.
fn unit(text: Option<&str>, absent: [f64; 3]) -> Result<Vector3<f64>, ReadError> {
    let axis = Vector3::from(filled(text, absent)?);
    axis.try_normalize(1e-12)
        .ok_or_else(|| ReadError::new("an axis without length"))
}
