//! What travels: the questions, by who answers them ([`Ask`]), and the answers ([`Response`]).

mod archive;
mod ask;
mod command;
mod order;
mod reply;
mod response;
mod status;
mod tenant;

pub use archive::{Frame, HeadView, Heads, PlainRecords, PlainView, SealedRecords, SealedView};
pub use ask::{ArchiveAsk, Ask, DoorAsk, PersonAsk, TenantAsk, TenantVerb};
pub use command::{Command, OnClash, Query};
pub use order::Order;
pub use reply::{Reply, Told};
pub(crate) use response::ResponseMap;
pub use response::{
    Busy, ErrorCode, Failed, FeedView, Hello, Quota, QuotaExceeded, Rejected, RejectionCode,
    Response, Waited,
};
pub use status::{ActionView, KnownExemplar, Phase, Status, Teachable};
pub use tenant::{ErasedView, KeyView, Ordered, TenantView};
