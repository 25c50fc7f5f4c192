//! What travels: requests, by who answers them ([`Ask`]), and answers ([`Response`]).

mod archive;
mod ask;
mod command;
mod order;
mod reply;
mod response;
mod status;
mod tenant;

pub use archive::{Frame, HeadView, Heads, PlainRecords, PlainView, SealedRecords, SealedView};
pub use ask::{ArchiveAsk, Ask, PersonAsk, ServiceAsk, TenantAsk, TenantVerb};
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
