//! Inertials that no body has: a principal moment that is more than the sum of the other two, or below 0. The
//! nearest that a body has stands in their place as a prior.

use nalgebra::{Matrix3, Vector3};

use super::link::{Body, Link};
use cft_ident_core::robot::tree::space::Rotation;
use cft_ident_logs::log::list;

/// Share of the largest second moment that the least one has at least in what is put in the place of an impossible
/// inertia.
const LEAST: f64 = 1e-2;
/// Share of it below 0 that rounding of the file explains.
const ROUNDED: f64 = 1e-3;

/// Puts possible inertias in the place of impossible ones; a sentence that names their links.
pub(super) fn mended(links: &mut [Link]) -> Option<String> {
    let mut names = Vec::new();
    for link in links {
        if let Some(body) = &mut link.body
            && let Some(inertia) = nearest(body)
        {
            body.inertia = inertia;
            names.push(link.name.as_str());
        }
    }
    (!names.is_empty()).then(|| {
        format!(
            "no body has the inertia of {}: a principal moment is below 0, or more than the sum of the others; the nearest possible one is the prior (CHECK IT: correct <inertia> in the URDF)",
            list(names.into_iter())
        )
    })
}

/// The nearest inertia that a body has, where this one has none: by the second moments along the principal axes,
/// half the trace less each moment.
fn nearest(body: &Body) -> Option<Rotation> {
    let inertia = Matrix3::from_fn(|i, j| body.inertia[i][j]);
    if body.mass <= 0.0 || inertia.iter().any(|x| !x.is_finite()) {
        return None;
    }
    let principal = inertia.symmetric_eigen();
    let moments = principal.eigenvalues;
    let second = moments.map(|moment| 0.5 * moments.sum() - moment);
    let most = second.max();
    if most <= 0.0 || second.min() >= -ROUNDED * most {
        return None;
    }
    let second: Vector3<f64> = second.map(|x| x.max(LEAST * most));
    let moments = second.map(|x| second.sum() - x);
    let axes = principal.eigenvectors;
    let nearest = axes * Matrix3::from_diagonal(&moments) * axes.transpose();
    Some(std::array::from_fn(|i| {
        std::array::from_fn(|j| nearest[(i, j)])
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(diagonal: [f64; 3]) -> Body {
        let inertia = std::array::from_fn(|i| {
            std::array::from_fn(|j| if i == j { diagonal[i] } else { 0.0 })
        });
        Body {
            mass: 1.0,
            centre: [0.0; 3],
            inertia,
        }
    }

    #[test]
    fn an_impossible_inertia_becomes_the_nearest_possible_one_and_a_possible_one_stays() {
        assert_eq!(nearest(&body([0.1, 0.2, 0.25])), None);
        assert_eq!(nearest(&body([0.1, 0.1, 0.2])), None);
        let found = nearest(&body([0.1, 0.1, 0.5])).unwrap();
        let moments = [found[0][0], found[1][1], found[2][2]];
        assert!(moments[0] + moments[1] > moments[2], "{moments:?}");
        assert!((moments[0] - moments[1]).abs() < 1e-12);
        assert!(nearest(&body([-0.1, 0.2, 0.2])).is_some());
    }
}
