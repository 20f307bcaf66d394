//! Capsules that hold the collision shapes of a URDF, those of meshes too.

use std::path::Path;

use super::shapes::ShapeForm;
use super::{CollisionShape, UrdfChain, mesh};
use crate::config::check_limits::MOST_CAPSULES;
use crate::config::limits::CapsuleSection;
use cft_ident_core::number::is_usable;
use cft_ident_core::robot::tree::enclosing::{BoundingBall, EnclosedPiece, enclosing, volume};
use cft_ident_core::robot::tree::space::{UNTURNED, Vector};
use cft_ident_logs::log::escape;

/// What a robot file declares of collision shapes.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct DeclaredCapsules {
    /// In the order of the links.
    pub sections: Vec<CapsuleSection>,
    /// Links of the URDF with shapes that no capsule holds.
    pub without: Vec<String>,
    /// Why, one clause for each such shape.
    pub reasons: Vec<String>,
}

/// The capsules of one link.
struct LinkCapsules {
    link: String,
    each: Vec<EnclosedPiece>,
    /// One that holds all.
    all: Option<EnclosedPiece>,
}

impl UrdfChain {
    /// Capsules about the collision shapes; `urdf` is the file that meshes are named in. A mesh that cannot be read is
    /// no error: collision shapes decide no torque.
    ///
    /// Each shape has its own, but where one about all shapes of a link is as small as theirs together, or where they
    /// are more than a robot file takes.
    pub fn capsules(&self, urdf: &Path) -> DeclaredCapsules {
        let folder = urdf
            .parent()
            .filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new("."));
        let (mut left, mut out) = (mesh::MOST_BYTES_OF_ALL, DeclaredCapsules::default());
        let mut held: Vec<LinkCapsules> = Vec::new();
        for first in &self.collisions {
            if held.iter().all(|held| held.link != first.on) {
                let own = self.collisions.iter().filter(|of| of.on == first.on);
                held.push(of_link(&first.on, own, folder, &mut left, &mut out));
            }
        }
        let count =
            |held: &[LinkCapsules]| -> usize { held.iter().map(|held| held.each.len()).sum() };
        while count(&held) > MOST_CAPSULES {
            let most = held.iter_mut().max_by_key(|held| held.each.len());
            let Some(LinkCapsules {
                each,
                all: Some(all),
                ..
            }) = most.filter(|held| held.each.len() > 1)
            else {
                break;
            };
            *each = vec![*all];
        }
        let sections = held.into_iter().flat_map(|held| {
            let section = move |([from, to], radius): EnclosedPiece| CapsuleSection {
                link: held.link.clone(),
                from,
                to,
                radius,
            };
            held.each.into_iter().map(section)
        });
        out.sections = sections.collect();
        out
    }
}

/// The capsules of a link with these shapes; what has none is reported in `out`.
fn of_link<'c>(
    link: &str,
    collisions: impl Iterator<Item = &'c CollisionShape>,
    folder: &Path,
    left: &mut u64,
    out: &mut DeclaredCapsules,
) -> LinkCapsules {
    let (mut balls, mut each): (Vec<BoundingBall>, Vec<EnclosedPiece>) = (Vec::new(), Vec::new());
    for collision in collisions {
        let begin = balls.len();
        match add(collision, folder, left, &mut balls) {
            Ok(piece) => each.extend(piece),
            Err(reason) => {
                balls.truncate(begin);
                if !out.without.contains(&collision.of) {
                    out.without.push(collision.of.clone());
                }
                out.reasons
                    .push(format!("{}: {reason}", escape(&collision.of)));
            }
        }
    }
    let all = (each.len() > 1).then(|| enclosing(&balls, &UNTURNED).map(written));
    let all = all.flatten();
    if let Some(all) = all
        && volume(&all) <= each.iter().map(volume).sum()
    {
        each = vec![all];
    }
    LinkCapsules {
        link: link.to_owned(),
        each,
        all,
    }
}

/// Adds a shape as balls, and gives the capsule that holds it.
fn add(
    collision: &CollisionShape,
    folder: &Path,
    left: &mut u64,
    balls: &mut Vec<BoundingBall>,
) -> Result<Option<EnclosedPiece>, String> {
    let unreadable = || "a shape that cannot be read".to_owned();
    let shape = collision.shape.as_ref().ok_or_else(unreadable)?;
    Ok(match &shape.form {
        ShapeForm::Within((ends, radius)) => {
            let ends = ends.map(|end| shape.place(&end));
            balls.extend(ends.map(|end| (end, *radius)));
            Some((ends, *radius))
        }
        ShapeForm::Mesh(file, scale) => {
            let vertices = mesh::read(file, folder, left)?;
            let begin = balls.len();
            let scaled = |x: &Vector| std::array::from_fn(|k| scale[k] * x[k]);
            balls.extend(vertices.iter().map(|x| (shape.place(&scaled(x)), 0.0)));
            let own = &balls[begin..];
            if !own.iter().all(|(x, _)| x.iter().all(|x| is_usable(*x))) {
                return Err(format!("{}: vertices beyond 1e30 m", escape(file)));
            }
            let axis = |k: usize| -> Vector { std::array::from_fn(|i| shape.rotation[i][k]) };
            enclosing(own, &[axis(0), axis(1), axis(2)]).map(written)
        }
    })
}

/// The same with a radius that holds it still when its ends are written to the micrometre.
fn written((ends, radius): EnclosedPiece) -> EnclosedPiece {
    (ends, ((radius * 1e6).ceil() + 1.0) / 1e6)
}
