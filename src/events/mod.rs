//! What happened, in the past tense: the one [`Event`] enum, its record on disk, and the codec.

mod codec;
mod event;
mod receipt;
mod record;
mod tenant;
mod upcast;

pub use crate::language::Report;
pub use codec::{DecodeError, decode, encode};
pub use event::{
    DecompositionDeclined, DecompositionTaught, Ending, EpisodeEnded, EpisodeStarted, Event,
    EventKind, Interpreted, LessonForgotten, RetrainCompleted, RetrainFailed, RetrainScheduled,
    SessionClosed, SessionOpened,
};
pub use receipt::Durable;
pub use record::{Batch, Head, Header, HeaderError, Record, Times, commitment};
pub use tenant::{
    KeyAdmitted, KeyRetired, Overlap, PersonErased, Quotas, QuotasSet, Role, SegmentClosed,
    TenantDisabled, TenantEnabled, TenantEvent, TenantOpened,
};
