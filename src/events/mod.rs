//! What happened, in the past tense: the one [`Event`] enum, its record on disk, and the codec.

mod codec;
mod event;
mod record;
mod tenant;
mod upcast;

pub use apprentice_core::header::{Header, HeaderError, commitment};
pub use apprentice_core::language::Report;
pub use apprentice_core::outcomes::Ending;
pub use apprentice_core::tenants::{PersonErased, Quotas, Role};

pub use codec::{DecodeError, decode, encode};
pub use event::{
    DecompositionDeclined, DecompositionTaught, EpisodeEnded, EpisodeStarted, Event, EventKind,
    Interpreted, LessonForgotten, MarkedWrong, RetrainCompleted, RetrainFailed, RetrainScheduled,
    SessionClosed, SessionOpened,
};
pub use record::{Batch, Head, Record, Times};
pub use tenant::{
    KeyAdmitted, KeyRetired, Overlap, QuotasSet, SegmentClosed, TenantDisabled, TenantEnabled,
    TenantEvent, TenantOpened,
};
