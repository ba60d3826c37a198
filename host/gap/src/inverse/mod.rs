//! Inverse dynamics of a record: what torque a model leaves over along the measured motion, weighted so that the
//! encoder's noise stays small.

mod base;
mod coarser;
mod fit;
mod follow;
mod free;
mod kernel;
mod load;
mod model;
mod motion;
mod record;
mod twin;

pub use base::{scale, sees_bristles};
pub use coarser::coarser;
pub use fit::{
    Fit, PROMISES, STANDS_STILL, cost_at, fit, fit_alone, fit_at, fit_near, fit_near_until, fit_on,
    fit_roughly,
};
pub use follow::{Later, Rubbing, Running, left_over};
pub use free::{Free, Own, Owner};
pub use kernel::{EFFORT, Kernel};
pub use load::Corrects;
pub use model::{Added, DELAYS, Model, OFFSET, Point};
pub use record::{Record, Stretch};
pub use twin::twins;
