//! Who is awake: one mailbox for each person, one pool of trainers, one directory for all. What
//! they decide stands in `seat/` and `directory/`, without actix; the actors carry it out.

mod archive;
mod awake;
mod clock;
mod defect;
mod directory;
mod failure;
mod meters;
mod notifications;
mod operator;
mod presence;
mod registrar;
mod response;
mod seat;
mod shared;
mod submit;
mod system;
mod tenant_registry;
mod trainer;
mod user;

pub use archive::{
    ArchiveAsk, ArchiveReader, Frame, HeadView, Heads, PlainRecords, PlainView, SealedRecords,
    SealedView,
};
pub use clock::wall_clock;
pub use directory::{
    Directory, DirectoryEffect, DirectoryInput, Letter, NotDelivered, Undelivered,
};
pub use failure::{Alarm, Failure};
pub use meters::{Refusals, Usage};
pub use notifications::{CommitNotification, CommitNotifications};
pub use operator::{ErasedView, KeyView, Ordered, TenantAsk, TenantVerb, TenantView};
pub use presence::{Attention, Presence};
pub use registrar::{Erased, Obeyed, Registrar, Signed};
pub use response::{
    Ask, Busy, DoorAsk, ErrorCode, Failed, FeedView, Hello, PersonAsk, Quota, QuotaExceeded,
    Rejected, Response, Waited,
};
pub use seat::{Effect, Input, NewSession, Seat, Timer};
pub use submit::{AnswerTo, Submit};
pub use system::{ActorSettings, ActorSystem, ActorsError, Front, NotTaken, Wakings};
pub use tenant_registry::{OrderError, TenantRegistry, fold as fold_tenant};
