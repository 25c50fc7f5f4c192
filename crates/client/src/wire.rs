//! The wire, version 1: one MessagePack map for each message. See `schema/wire.md`.

use std::fmt;
use std::io::Cursor;

use apprentice_core::ids::{RequestId, Seq, StreamKey, TenantId, UserId};
use apprentice_core::limits::{FRAME_BYTES_MAX, WIRE_DEPTH_MAX};
use apprentice_core::plain;
use serde::de::{DeserializeOwned, IgnoredAny, MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize};

use crate::protocol::{
    ArchiveAsk, Ask, Command, ErrorCode, Failed, Order, PersonAsk, Query, Response, ResponseMap,
    ServiceAsk, TenantAsk, TenantVerb,
};

/// The version that this program writes and reads.
pub const VERSION: u64 = 1;

/// The commands that people may send, as they are spelled on the wire.
pub const COMMANDS: [&str; 8] = Command::NAMES;
/// Commands that only the service itself gives. A message with one of them is refused.
pub const INTERNAL_COMMANDS: [&str; 2] = ["open", "finish_retrain"];
/// The queries, as they are spelled on the wire.
pub const QUERIES: [&str; 9] =
    ["look", "known", "status", "wait", "hello", "feed", "heads", "records", "plain_records"];
/// The orders that operators may give, as they are spelled on the wire.
pub const ORDERS: [&str; 9] =
    ["list", "add", "admit", "retire", "rotate", "disable", "enable", "set_quotas", "erase"];

/// A request.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// Chosen by the client. The same request with the same id is carried out once.
    pub id: RequestId,
    /// The person in whose name it is sent.
    pub user: UserId,
    /// What is asked.
    pub ask: Ask,
}

/// A message that is not a request, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Refused {
    /// The id, if it could be read: only then can the message be answered.
    pub id: Option<RequestId>,
    /// The answer.
    pub failed: Failed,
}

/// A query on the wire.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum WireQuery {
    Look,
    Known,
    Status,
    Wait {
        seconds: u32,
    },
    Hello,
    Feed,
    Heads {
        #[serde(default)]
        after: Option<StreamKey>,
        limit: u32,
    },
    Records {
        stream: StreamKey,
        from: Seq,
        limit: u32,
    },
    PlainRecords {
        stream: StreamKey,
        from: Seq,
        limit: u32,
    },
}

impl WireQuery {
    fn of_archive(ask: &ArchiveAsk) -> WireQuery {
        match *ask {
            ArchiveAsk::Heads { after, limit } => WireQuery::Heads { after, limit },
            ArchiveAsk::Sealed { stream, from, limit } => {
                WireQuery::Records { stream, from, limit }
            }
            ArchiveAsk::Plain { stream, from, limit } => {
                WireQuery::PlainRecords { stream, from, limit }
            }
        }
    }

    fn ask(self) -> Ask {
        Ask::Archive(match self {
            WireQuery::Look => return Query::Look.into(),
            WireQuery::Known => return Query::Known.into(),
            WireQuery::Status => return Query::Status.into(),
            WireQuery::Wait { seconds } => return Ask::Person(PersonAsk::Wait { seconds }),
            WireQuery::Hello => return ServiceAsk::Hello.into(),
            WireQuery::Feed => return ServiceAsk::Feed.into(),
            WireQuery::Heads { after, limit } => ArchiveAsk::Heads { after, limit },
            WireQuery::Records { stream, from, limit } => {
                ArchiveAsk::Sealed { stream, from, limit }
            }
            WireQuery::PlainRecords { stream, from, limit } => {
                ArchiveAsk::Plain { stream, from, limit }
            }
        })
    }
}

#[derive(Serialize)]
struct RequestMap<'a> {
    v: u64,
    id: RequestId,
    user: &'a UserId,
    #[serde(skip_serializing_if = "Option::is_none")]
    command: Option<&'a Command>,
    #[serde(skip_serializing_if = "Option::is_none")]
    query: Option<WireQuery>,
    #[serde(skip_serializing_if = "Option::is_none")]
    order: Option<OrderField<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    tenant: Option<&'a TenantId>,
}

// A request is read field by field, the id first. So each fault is named, and the refusal reaches
// the caller, who waits for it.
#[derive(Deserialize)]
struct IdField {
    id: RequestId,
}

#[derive(Deserialize)]
struct VersionField {
    v: u64,
}

#[derive(Deserialize)]
struct UserField {
    user: UserId,
}

#[derive(Deserialize)]
struct VerbFields {
    #[serde(default)]
    command: Option<Verb>,
    #[serde(default)]
    query: Option<Verb>,
    #[serde(default)]
    order: Option<Verb>,
}

#[derive(Deserialize)]
struct CommandField {
    command: Command,
}

#[derive(Deserialize)]
struct QueryField {
    query: WireQuery,
}

#[derive(Deserialize)]
struct TenantField {
    #[serde(default)]
    tenant: Option<TenantId>,
}

#[derive(Deserialize)]
struct OrderOf<T> {
    order: T,
}

/// The verbs of operators that are not an [`Order`]: they change no tenant.
#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum OtherOrder {
    List,
    Erase { user: UserId },
}

#[derive(Serialize)]
#[serde(untagged)]
enum OrderField<'a> {
    Order(&'a Order),
    Other(OtherOrder),
}

impl OrderField<'_> {
    fn of(verb: &TenantVerb) -> OrderField<'_> {
        match verb {
            TenantVerb::Give(order) => OrderField::Order(order),
            TenantVerb::List => OrderField::Other(OtherOrder::List),
            TenantVerb::Erase { user } => {
                OrderField::Other(OtherOrder::Erase { user: user.clone() })
            }
        }
    }
}

/// The request as one MessagePack map.
///
/// - panics: never; requests are plain data.
pub fn encode_request(request: &Request) -> Vec<u8> {
    let mut map = RequestMap {
        v: VERSION,
        id: request.id,
        user: &request.user,
        command: None,
        query: None,
        order: None,
        tenant: None,
    };
    match &request.ask {
        Ask::Person(PersonAsk::Command(command)) => map.command = Some(command),
        Ask::Person(PersonAsk::Query(Query::Look)) => map.query = Some(WireQuery::Look),
        Ask::Person(PersonAsk::Query(Query::Known)) => map.query = Some(WireQuery::Known),
        Ask::Person(PersonAsk::Query(Query::Status)) => map.query = Some(WireQuery::Status),
        Ask::Person(PersonAsk::Wait { seconds }) => {
            map.query = Some(WireQuery::Wait { seconds: *seconds })
        }
        Ask::Service(ServiceAsk::Hello) => map.query = Some(WireQuery::Hello),
        Ask::Service(ServiceAsk::Feed) => map.query = Some(WireQuery::Feed),
        Ask::Archive(ask) => map.query = Some(WireQuery::of_archive(ask)),
        Ask::Order(TenantAsk { tenant, verb }) => {
            (map.order, map.tenant) = (Some(OrderField::of(verb)), tenant.as_ref());
        }
    }
    pack(&map)
}

/// Reads a request. Unknown fields are ignored; unknown verbs are refused by name.
///
/// - errors: [`Refused`], with one sentence. No bytes make it panic.
pub fn decode_request(bytes: &[u8]) -> Result<Request, Refused> {
    let id = unpack::<IdField>(bytes).map(|field| field.id);
    let refuse = |code, message: String| Refused {
        id: id.as_ref().ok().copied(),
        // It may quote bytes that anybody sent.
        failed: Failed { code, message: plain::escape(&message).into_owned() },
    };
    if bytes.len() > FRAME_BYTES_MAX {
        let found = bytes.len();
        let message = format!("the message has {found} bytes; at most {FRAME_BYTES_MAX} are read");
        return Err(refuse(ErrorCode::TooLarge, message));
    }
    let malformed = |what: &str, reason: String| {
        refuse(ErrorCode::Malformed, format!("the request's {what} cannot be read: {reason}"))
    };
    let checked_id = match &id {
        Ok(id) => *id,
        Err(reason) => return Err(malformed("id", reason.clone())),
    };
    let version = unpack::<VersionField>(bytes).map_err(|reason| malformed("v", reason))?.v;
    if version != VERSION {
        let message =
            format!("wire version {version} is not spoken here; this service speaks {VERSION}");
        return Err(refuse(ErrorCode::UnsupportedVersion, message));
    }
    let user = unpack::<UserField>(bytes).map_err(|reason| malformed("user", reason))?.user;
    let verbs = unpack::<VerbFields>(bytes).map_err(|reason| malformed("verb", reason))?;
    let ask = match (verbs.command, verbs.query, verbs.order) {
        (Some(Verb(verb)), None, None) => {
            check_command(&verb).map_err(|(code, message)| refuse(code, message))?;
            let command = unpack::<CommandField>(bytes)
                .map_err(|reason| malformed(&format!("command {verb:?}"), reason))?;
            command.command.into()
        }
        (None, Some(Verb(verb)), None) => {
            check_query(&verb).map_err(|message| refuse(ErrorCode::UnknownVerb, message))?;
            let query = unpack::<QueryField>(bytes)
                .map_err(|reason| malformed(&format!("query {verb:?}"), reason))?;
            query.query.ask()
        }
        (None, None, Some(Verb(verb))) => {
            check_order(&verb).map_err(|message| refuse(ErrorCode::UnknownVerb, message))?;
            let unreadable = |reason| malformed(&format!("order {verb:?}"), reason);
            let TenantField { tenant } = unpack(bytes).map_err(unreadable)?;
            let verb = unpack_order(&verb, bytes).map_err(unreadable)?;
            Ask::Order(TenantAsk { tenant, verb })
        }
        (None, None, None) => {
            let message = "a request has a command, a query or an order; this one has neither";
            return Err(refuse(ErrorCode::Malformed, message.to_owned()));
        }
        _ => {
            let message = "a request has one of command, query and order; this one has both";
            return Err(refuse(ErrorCode::Malformed, message.to_owned()));
        }
    };
    Ok(Request { id: checked_id, user, ask })
}

fn check_command(verb: &str) -> Result<(), (ErrorCode, String)> {
    if COMMANDS.contains(&verb) {
        return Ok(());
    }
    if INTERNAL_COMMANDS.contains(&verb) {
        let message = format!("the command {verb:?} comes from inside the service alone");
        return Err((ErrorCode::InternalVerb, message));
    }
    let known = COMMANDS.join(", ");
    let message = format!("unknown command {:?}; the commands are {known}", shorten(verb));
    Err((ErrorCode::UnknownVerb, message))
}

fn check_query(verb: &str) -> Result<(), String> {
    match QUERIES.contains(&verb) {
        true => Ok(()),
        false => Err(format!(
            "unknown query {:?}; the queries are {}",
            shorten(verb),
            QUERIES.join(", ")
        )),
    }
}

fn check_order(verb: &str) -> Result<(), String> {
    match ORDERS.contains(&verb) {
        true => Ok(()),
        false => {
            let known = ORDERS.join(", ");
            Err(format!("unknown order {:?}; the orders are {known}", shorten(verb)))
        }
    }
}

fn unpack_order(verb: &str, bytes: &[u8]) -> Result<TenantVerb, String> {
    Ok(match verb {
        "list" | "erase" => match unpack::<OrderOf<OtherOrder>>(bytes)?.order {
            OtherOrder::List => TenantVerb::List,
            OtherOrder::Erase { user } => TenantVerb::Erase { user },
        },
        _ => TenantVerb::Give(unpack::<OrderOf<Order>>(bytes)?.order),
    })
}

fn shorten(text: &str) -> String {
    text.chars().take(40).collect()
}

/// The response to the request `id` as one MessagePack map.
///
/// - panics: never; responses are plain data.
pub fn encode_response(id: RequestId, response: Response) -> Vec<u8> {
    pack(&ResponseMap::new(VERSION, id, response))
}

/// Reads a response and the id of the request that it answers. Unknown fields are ignored.
///
/// - errors: a sentence. No bytes make it panic.
pub fn decode_response(bytes: &[u8]) -> Result<(RequestId, Response), String> {
    let map: ResponseMap = unpack(bytes)?;
    if map.v != VERSION {
        return Err(format!("wire version {} is not spoken here; {VERSION} is", map.v));
    }
    let id = map.id.ok_or("the response carries no request id")?;
    let mut found = map.carried();
    match (found.next(), found.next()) {
        (Some(response), None) => Ok((id, response)),
        (None, _) => Err("the response carries nothing that this client knows".to_owned()),
        (Some(_), Some(_)) => Err("the response carries more than one answer".to_owned()),
    }
}

/// The name of a verb: a text, or the only key of a map.
struct Verb(String);

impl<'de> Deserialize<'de> for Verb {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Verb, D::Error> {
        struct VerbVisitor;
        impl<'de> Visitor<'de> for VerbVisitor {
            type Value = Verb;
            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a verb, or a map from one verb to its arguments")
            }
            fn visit_str<E: serde::de::Error>(self, verb: &str) -> Result<Verb, E> {
                Ok(Verb(verb.to_owned()))
            }
            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Verb, A::Error> {
                use serde::de::Error;
                let expected =
                    || A::Error::custom("a map from one verb to its arguments is wanted");
                let (verb, _) = map.next_entry::<String, IgnoredAny>()?.ok_or_else(expected)?;
                match map.next_key::<IgnoredAny>()? {
                    None => Ok(Verb(verb)),
                    Some(_) => Err(expected()),
                }
            }
        }
        deserializer.deserialize_any(VerbVisitor)
    }
}

/// One message as a MessagePack map with named fields.
///
/// - panics: never; messages are plain data.
pub fn pack<T: Serialize>(value: &T) -> Vec<u8> {
    rmp_serde::to_vec_named(value).expect("wire messages are plain data and encode into memory")
}

/// Reads one message, and nothing after it.
///
/// - errors: a sentence. No bytes make it panic.
pub fn unpack<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, String> {
    let mut decoder = rmp_serde::Deserializer::new(Cursor::new(bytes));
    // Deeply nested maps must not overflow the gateway's stack.
    decoder.set_max_depth(WIRE_DEPTH_MAX);
    let value = T::deserialize(&mut decoder).map_err(|error| error.to_string())?;
    match decoder.position() == bytes.len() as u64 {
        true => Ok(value),
        false => Err("bytes follow after the end of the map".to_owned()),
    }
}
