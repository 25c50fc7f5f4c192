//! Who is awake: one mailbox for each person, one pool of trainers, one directory for all. What
//! they decide stands in `seat/` and `directory/`, without actix; the actors carry it out.

mod archive;
mod awake;
mod book;
mod clock;
mod defect;
mod directory;
mod failure;
mod growth;
mod house;
mod meters;
mod operator;
mod presence;
mod registrar;
mod response;
mod seat;
mod shared;
mod submit;
mod trainer;
mod user;

pub use archive::{
    ArchiveAsk, Frame, HeadView, Heads, PlainRecords, PlainView, Reader, SealedRecords, SealedView,
};
pub use book::{Book, OrderError, fold as fold_tenant};
pub use clock::wall_clock;
pub use directory::{
    Directory, DirectoryEffect, DirectoryInput, Letter, NotDelivered, Undelivered,
};
pub use failure::{Alarm, Failure};
pub use growth::{Growth, Growths};
pub use house::{ActorsError, Front, House, HouseSettings, NotTaken, Wakings};
pub use meters::{Refusals, Usage};
pub use operator::{ErasedView, KeyView, Ordered, TenantAsk, TenantVerb, TenantView};
pub use presence::{Attention, Presence};
pub use registrar::{Erased, Obeyed, Registrar, Signed};
pub use response::{
    Ask, Busy, DoorAsk, ErrorCode, Failed, FeedView, Hello, PersonAsk, Quota, QuotaExceeded,
    Rejected, Response, Waited,
};
pub use seat::{Effect, Input, NewSession, Seat, Timer};
pub use submit::{AnswerTo, Submit};
