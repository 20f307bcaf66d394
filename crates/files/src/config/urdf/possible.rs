//! Inertials that no body has: a principal moment that is more than the sum of the other two, or below 0. They stay
//! what they are, for a URDF of identified base parameters has such ones; a fit takes them for no prior.

use super::link::{Body, Link};
use cft_ident_core::robot::standard::{self, WRITTEN};
use cft_ident_logs::log::list;

/// A sentence that names the links whose inertia no body has.
pub(super) fn impossible(links: &[Link]) -> Option<String> {
    let wrong = |link: &&Link| link.body.as_ref().is_some_and(is_impossible);
    let names: Vec<&str> = (links.iter().filter(wrong))
        .map(|link| link.name.as_str())
        .collect();
    (!names.is_empty()).then(|| {
        format!(
            "no body has the inertia of {}: a principal moment is below 0, or more than the sum of the others; it counts as no prior (CHECK IT: correct <inertia> in the URDF)",
            list(names.into_iter())
        )
    })
}

fn is_impossible(body: &Body) -> bool {
    let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = body.inertia;
    let written = standard::Body {
        mass: body.mass,
        centre: body.centre,
        inertia: [xx, xy, xz, yy, yz, zz],
    };
    body.mass > 0.0 && written.physical(WRITTEN).is_none()
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
    fn an_inertia_is_impossible_where_a_moment_is_more_than_the_others_or_below_zero() {
        assert!(!is_impossible(&body([0.1, 0.2, 0.25])));
        assert!(!is_impossible(&body([0.1, 0.1, 0.2])));
        assert!(is_impossible(&body([0.1, 0.1, 0.5])));
        assert!(is_impossible(&body([-0.1, 0.2, 0.2])));
    }
}
