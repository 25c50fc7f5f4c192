//! The names of things: identifiers that cannot be mistaken for one another.

mod within_tenant;

pub use self::within_tenant::WithinTenant;

use std::cmp::Ordering;
use std::fmt;
use std::hash::{Hash, Hasher};
use std::num::NonZeroU64;
use std::str::FromStr;

use data_encoding::{HEXLOWER, HEXLOWER_PERMISSIVE};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use crate::limits;
use crate::plain::{self, Hidden};

/// Why a piece of text is no identifier.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IdError {
    #[error("a {what} must not be empty")]
    Empty { what: &'static str },
    #[error("a {what} has at most {max} bytes, but this one has {found}")]
    TooLong { what: &'static str, max: usize, found: usize },
    #[error("a {what} may not contain {found:?}; allowed are {allowed}")]
    Character { what: &'static str, found: char, allowed: &'static str },
    #[error("a {what}: {hidden}")]
    Hidden { what: &'static str, hidden: Hidden },
    #[error(
        "character {place} of a {what} is {found:?}; the only blanks allowed are spaces (U+0020) \
         between words"
    )]
    Blank { what: &'static str, found: char, place: usize },
    #[error("a {what} may not begin with '-': a command would read it as an option")]
    Option { what: &'static str },
    #[error("{found:?} is not a {what}: expected {expected}")]
    Form { what: &'static str, found: String, expected: &'static str },
}

/// A lab. Lower-case letters, digits and hyphens, 1 to [`limits::TENANT_BYTES_MAX`] bytes.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct TenantId(String);

impl TenantId {
    /// The tenant of the single-user default.
    pub fn local() -> Self {
        TenantId("local".to_owned())
    }

    /// - errors: empty, longer than [`limits::TENANT_BYTES_MAX`], or a character that is not
    ///   `a-z`, `0-9` or `-`: a tenant names files and trees, so it must never carry a path.
    pub fn new(text: &str) -> Result<Self, IdError> {
        check_length("tenant", text, limits::TENANT_BYTES_MAX)?;
        let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        match text.chars().find(|&c| !allowed(c)) {
            Some(found) => {
                Err(IdError::Character { what: "tenant", found, allowed: "a-z, 0-9 and '-'" })
            }
            None => Ok(TenantId(text.to_owned())),
        }
    }

    /// Whether a new tenant may be called so. Older versions made tenants of more names; those stay.
    ///
    /// - errors: a leading hyphen.
    pub fn check_new(&self) -> Result<(), IdError> {
        match self.0.starts_with('-') {
            true => Err(IdError::Option { what: "tenant" }),
            false => Ok(()),
        }
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for TenantId {
    type Error = IdError;
    fn try_from(text: String) -> Result<Self, IdError> {
        TenantId::new(&text)
    }
}

impl From<TenantId> for String {
    fn from(id: TenantId) -> String {
        id.0
    }
}

impl fmt::Display for TenantId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// A person inside a tenant, as the tenant's gateway names them. A text without control characters;
/// it appears in no key, head or proof (see [`StreamId`]). Somebody new needs a name that
/// [`UserId::check_new`] accepts, too.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct UserId(String);

impl UserId {
    /// - errors: empty, longer than [`limits::USER_BYTES_MAX`], or a control character.
    pub fn new(text: &str) -> Result<Self, IdError> {
        check_length("user", text, limits::USER_BYTES_MAX)?;
        match text.chars().find(|c| c.is_control()) {
            Some(found) => {
                Err(IdError::Character { what: "user", found, allowed: "printable characters" })
            }
            None => Ok(UserId(text.to_owned())),
        }
    }

    /// Whether somebody new may be called so: two names that look the same should be one. Older
    /// versions recorded people with more names; those stay reachable.
    ///
    /// - errors: a [hidden](plain::check) character; white space at an end; white space other than
    ///   U+0020.
    pub fn check_new(&self) -> Result<(), IdError> {
        let what = "user";
        plain::check(&self.0).map_err(|hidden| IdError::Hidden { what, hidden })?;
        let last = self.0.chars().count();
        let at_an_end = |place: usize| place == 1 || place == last;
        let blank = (1..)
            .zip(self.0.chars())
            .find(|&(place, c)| c.is_whitespace() && (c != ' ' || at_an_end(place)));
        match blank {
            Some((place, found)) => Err(IdError::Blank { what, found, place }),
            None => Ok(()),
        }
    }

    pub fn as_str(&self) -> &str {
        &self.0
    }
}

impl TryFrom<String> for UserId {
    type Error = IdError;
    fn try_from(text: String) -> Result<Self, IdError> {
        UserId::new(&text)
    }
}

impl From<UserId> for String {
    fn from(id: UserId) -> String {
        id.0
    }
}

impl fmt::Display for UserId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

// A user name is personal data: it must not slip into a log line through `{:?}`.
impl fmt::Debug for UserId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("UserId(..)")
    }
}

fn check_length(what: &'static str, text: &str, max: usize) -> Result<(), IdError> {
    match text.len() {
        0 => Err(IdError::Empty { what }),
        found if found > max => Err(IdError::TooLong { what, max, found }),
        _ => Ok(()),
    }
}

/// One person's life in one tenant: the unit of order, of sealing and of replay.
///
/// `key` is a keyed hash of the user name (`store::keys`), so that names stand in no key.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StreamId {
    pub tenant: TenantId,
    pub key: StreamKey,
}

// By tenant, then key. Written out because a key alone has no order (see [`StreamKey`]).
impl Ord for StreamId {
    fn cmp(&self, other: &StreamId) -> Ordering {
        (&self.tenant, &self.key.0).cmp(&(&other.tenant, &other.key.0))
    }
}

impl PartialOrd for StreamId {
    fn partial_cmp(&self, other: &StreamId) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Hash for StreamId {
    fn hash<H: Hasher>(&self, hasher: &mut H) {
        (&self.tenant, &self.key.0).hash(hasher);
    }
}

impl fmt::Display for StreamId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.tenant, self.key)
    }
}

/// Declares a fixed-size byte identifier that reads and prints as lower-case hex and is stored as
/// MessagePack `bin`.
macro_rules! byte_id {
    ($(#[$attribute:meta])* $name:ident, $size:expr, $what:literal, $expected:literal) => {
        $(#[$attribute])*
        #[derive(Clone, Copy, PartialEq, Eq)]
        pub struct $name(pub [u8; $size]);

        impl $name {
            pub fn to_hex(&self) -> String {
                HEXLOWER.encode(&self.0)
            }
        }

        impl fmt::Display for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str(&self.to_hex())
            }
        }

        impl fmt::Debug for $name {
            fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(f, "{}({})", stringify!($name), self.to_hex())
            }
        }

        impl FromStr for $name {
            type Err = IdError;
            fn from_str(text: &str) -> Result<Self, IdError> {
                let wrong = || IdError::Form {
                    what: $what,
                    found: text.chars().take(80).collect(),
                    expected: $expected,
                };
                let bytes = HEXLOWER_PERMISSIVE.decode(text.as_bytes()).map_err(|_| wrong())?;
                bytes.try_into().map($name).map_err(|_| wrong())
            }
        }

        impl Serialize for $name {
            fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
                if serializer.is_human_readable() {
                    serializer.serialize_str(&self.to_hex())
                } else {
                    serializer.serialize_bytes(&self.0)
                }
            }
        }

        impl<'de> Deserialize<'de> for $name {
            fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
                struct Visitor;
                impl serde::de::Visitor<'_> for Visitor {
                    type Value = $name;
                    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                        f.write_str($expected)
                    }
                    fn visit_bytes<E: serde::de::Error>(self, v: &[u8]) -> Result<$name, E> {
                        let bytes = v
                            .try_into()
                            .map_err(|_| E::invalid_length(v.len(), &self))?;
                        Ok($name(bytes))
                    }
                    fn visit_str<E: serde::de::Error>(self, v: &str) -> Result<$name, E> {
                        v.parse().map_err(E::custom)
                    }
                }
                if deserializer.is_human_readable() {
                    deserializer.deserialize_str(Visitor)
                } else {
                    deserializer.deserialize_bytes(Visitor)
                }
            }
        }
    };
}

byte_id!(
    /// The keyed hash that stands for a user name. 16 bytes.
    ///
    /// It names a stream inside one tenant and no stream among several: every tenant's own stream has
    /// the same key. So it has no order and no hash, and nothing can be indexed by it alone. Index by
    /// [`StreamId`], or inside one tenant with [`WithinTenant`].
    ///
    /// ```compile_fail,E0277
    /// let mut streams = std::collections::BTreeMap::new();
    /// streams.insert(apprentice_core::ids::StreamKey::TENANT, "the last lab only");
    /// ```
    ///
    /// ```compile_fail,E0277
    /// let key = apprentice_core::ids::StreamKey::TENANT;
    /// std::collections::HashMap::from([(key, "the last lab only")]);
    /// ```
    StreamKey, 16, "stream key", "32 hexadecimal digits"
);
byte_id!(
    /// Names one request of one client, for ever: a retry carries the same one. 16 bytes.
    #[derive(PartialOrd, Ord, Hash)]
    RequestId, 16, "request id", "32 hexadecimal digits"
);
byte_id!(
    /// The public half of a CURVE key (RFC 26): who a connection is. 32 bytes. Reads and prints as
    /// 64 hexadecimal digits; ZeroMQ's own form of 40 characters (Z85) is known to `frontends`.
    #[derive(PartialOrd, Ord, Hash)]
    PublicKey, 32, "public key", "64 hexadecimal digits"
);
byte_id!(
    /// An Ed25519 signature (RFC 8032). 64 bytes.
    #[derive(PartialOrd, Ord, Hash)]
    Signature, 64, "signature", "128 hexadecimal digits"
);
byte_id!(
    /// BLAKE3, 256 bits.
    #[derive(PartialOrd, Ord, Hash)]
    Digest, 32, "digest", "64 hexadecimal digits"
);

impl StreamKey {
    /// The tenant's own stream, of what operators did. No name hashes to it but by a chance of one
    /// in 2^128.
    pub const TENANT: StreamKey = StreamKey([0; 16]);
}

impl StreamId {
    /// The tenant's own stream.
    pub fn of_tenant(tenant: &TenantId) -> StreamId {
        StreamId { tenant: tenant.clone(), key: StreamKey::TENANT }
    }

    /// Whether this is a tenant's own stream, and nobody's life.
    pub fn is_tenants(&self) -> bool {
        self.key == StreamKey::TENANT
    }
}

impl Digest {
    /// What the first record of a stream names as its predecessor.
    pub const ZERO: Digest = Digest([0; 32]);

    pub fn of(bytes: &[u8]) -> Digest {
        Digest(*blake3::hash(bytes).as_bytes())
    }

    /// The first twelve hexadecimal digits: enough for a person to compare.
    pub fn short(&self) -> String {
        self.to_hex()[..12].to_owned()
    }
}

/// The place of a record in its stream: 1, 2, 3, … without a gap.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Seq(NonZeroU64);

impl Seq {
    pub const FIRST: Seq = Seq(NonZeroU64::MIN);

    pub fn new(number: u64) -> Option<Seq> {
        NonZeroU64::new(number).map(Seq)
    }

    pub fn get(self) -> u64 {
        self.0.get()
    }

    pub fn next(self) -> Seq {
        Seq(self.0.checked_add(1).expect("a stream never reaches 2^64 records"))
    }
}

impl fmt::Display for Seq {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.0)
    }
}

/// Microseconds since 1970-01-01T00:00Z, monotone within a stream.
#[derive(
    Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, Default,
)]
pub struct Timestamp(pub u64);

impl Timestamp {
    /// The time of a record that follows on one of this time. Times never run backwards within a
    /// stream: where the wall clock reads no later than the record before, the time is held, one
    /// microsecond above that record's.
    pub fn next(self, wall: Timestamp) -> Timestamp {
        wall.max(Timestamp(self.0.saturating_add(1)))
    }

    /// Whether this is a held time, when the batch before has the time `before`: see
    /// [`Timestamp::next`]. Two batches are never made within one microsecond, so no reading of a
    /// clock is taken for a held time. Builds before the release of 0.2 held the times of tenants' own
    /// streams at `before` itself.
    pub fn is_held(self, before: Timestamp) -> bool {
        self.0 <= before.0.saturating_add(1)
    }

    /// The last moment there is, when the sum would be beyond it.
    pub fn plus_seconds(self, seconds: u64) -> Timestamp {
        Timestamp(self.0.saturating_add(seconds.saturating_mul(1_000_000)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tenant_never_carries_a_path() {
        for bad in ["", "../x", "a/b", "A", "a\0", "ä", &"a".repeat(65)] {
            assert!(TenantId::new(bad).is_err(), "{bad:?}");
        }
        assert_eq!(TenantId::new("lab-7").unwrap().as_str(), "lab-7");
    }

    #[test]
    fn somebody_new_needs_a_name_that_looks_like_no_other() {
        for good in ["ada", "Ada Lovelace", "josé", "مریم", "山田 太郎", "=1+1", "👩\u{200d}🚀"]
        {
            assert_eq!(UserId::new(good).unwrap().check_new(), Ok(()), "{good:?}");
        }
        let odd =
            [" ada", "ada ", "ada\u{a0}", "ada\u{3000}x", "\u{feff}ada", "ad\u{200d}a", "\u{202e}"];
        for odd in odd {
            // It stays a name, for people who were recorded with it.
            assert!(UserId::new(odd).unwrap().check_new().is_err(), "{odd:?}");
        }
        let said = UserId::new("ada\u{2028}").unwrap().check_new().unwrap_err().to_string();
        assert!(said.starts_with("a user: character 4 is U+2028"), "{said}");
        assert!(TenantId::new("--data").unwrap().check_new().is_err());
        assert_eq!(TenantId::new("lab-").unwrap().check_new(), Ok(()));
    }

    #[test]
    fn hex_is_read_back() {
        let id = RequestId(*b"0123456789abcdef");
        assert_eq!(id.to_hex().parse::<RequestId>().unwrap(), id);
        assert!("zz".parse::<RequestId>().is_err());
        assert!("ä".repeat(16).parse::<RequestId>().is_err());
        assert!("+f".repeat(16).parse::<RequestId>().is_err());
        assert_eq!("AB".repeat(16).parse::<RequestId>().unwrap(), RequestId([0xab; 16]));
    }

    #[test]
    fn a_user_name_does_not_print_in_debug() {
        let user = UserId::new("Ada Lovelace").unwrap();
        assert!(!format!("{user:?}").contains("Ada"));
    }
}
