//! Who is awake: one mailbox for each person, one pool of trainers, one directory for all.

mod archive;
mod awake;
mod book;
mod clock;
mod directory;
mod failure;
mod farewell;
mod growth;
mod house;
mod life;
mod meters;
mod operator;
mod registrar;
mod response;
mod submit;
mod trainer;
mod user;

pub use archive::{
    ArchiveAsk, Frame, HeadView, Heads, PlainRecords, PlainView, Reader, SealedRecords, SealedView,
};
pub use book::{Book, OrderError, fold as fold_tenant};
pub use clock::wall_clock;
pub use failure::{Alarm, Failure};
pub use growth::{Growth, Growths};
pub use house::{ActorsError, Front, House, HouseSettings, NotTaken, Wakings};
pub use meters::{Refusals, Usage};
pub use operator::{ErasedView, KeyView, Ordered, TenantAsk, TenantVerb, TenantView};
pub use registrar::{Erased, Obeyed, Registrar, Signed};
pub use response::{
    Ask, Busy, ErrorCode, Failed, FeedView, Hello, Quota, QuotaExceeded, Rejected, Response, Waited,
};
pub use submit::{AnswerTo, Submit};
