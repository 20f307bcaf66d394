//! A plant to test against, and motions within limits. The estimators never import this crate.
//!
//! [`simulate::Plant`] is a robot with drives, friction and controller, run by [`simulate::run()`] along a
//! [`simulate::Reference`], with [`simulate::PlantEffects`] that no estimator declares. [`excite::Motion`] is a designed
//! motion, [`excite::judge`] says whether it stays within limits and what it teaches.
//!
//! ```
//! use cft_ident_plant::simulate::SmoothFriction;
//! use cft_ident_core::robot::friction::ViscousCoulomb;
//!
//! // a plant integrates a smooth law: at speed it is the declared one
//! let law = ViscousCoulomb { viscous: 0.8, coulomb: 1.5 };
//! let smooth = SmoothFriction::viscous_coulomb(law, 0.2);
//! assert!((smooth.torque(2.0) - law.torque(2.0)).abs() < 1e-3);
//! ```

#![forbid(unsafe_code)]

pub mod excite;
pub mod simulate;
