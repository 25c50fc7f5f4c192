//! Who is awake: one mailbox for each person, one pool of trainers, one directory for all.

mod awake;
mod book;
mod directory;
mod failure;
mod farewell;
mod house;
mod life;
mod meters;
mod operator;
mod registrar;
mod response;
mod submit;
mod trainer;
mod user;

pub use book::{Book, OrderError, fold as fold_tenant};
pub use failure::{Alarm, Failure};
pub use house::{ActorsError, Front, House, HouseSettings, NotTaken, Wakings};
pub use meters::{Refusals, Usage};
pub use operator::{ErasedView, KeyView, Ordered, TenantAsk, TenantVerb, TenantView};
pub use registrar::{Erased, Obeyed, Registrar, Signed};
pub use response::{
    Ask, Busy, ErrorCode, Failed, Hello, Quota, QuotaExceeded, Rejected, Response, Waited,
};
pub use submit::{AnswerTo, Submit};
