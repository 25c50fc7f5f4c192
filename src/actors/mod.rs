//! The actors: one for each person who is awake, a pool of trainers, and one directory that knows
//! who is awake. All decisions are in `seat/`, `directory/` and `registrar/`, without actix. The
//! actors carry them out.

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
mod seat;
mod shared;
mod submit;
mod system;
mod trainer;
mod user;

pub use archive::ArchiveReader;
pub use clock::wall_clock;
pub use directory::{
    Directory, DirectoryEffect, DirectoryInput, Letter, NotDelivered, Undelivered,
};
pub use failure::{Alarm, Failure};
pub use meters::{Refusals, Usage};
pub use notifications::{CommitNotification, CommitNotifications};
pub use operator::list_tenants;
pub use presence::{Attention, Presence};
pub use registrar::{
    Done, Erased, Moment, Obeyed, OrderError, Registrar, Signed, TenantRegistry, TenantWork,
    TenantWriter, WriterEffect, WriterInput, fold as fold_tenant, fold_all as fold_tenants,
};
pub use seat::{Effect, Input, NewSession, Seat, Timer};
pub use submit::{AnswerTo, Submit};
pub use system::{ActorSettings, ActorSystem, ActorsError, Front, NotTaken, Wakings};
