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

/// Why a text is not an identifier.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum IdError {
    /// The text is empty.
    #[error("a {what} must not be empty")]
    Empty {
        /// The kind of identifier: `tenant`, `user`.
        what: &'static str,
    },
    /// The text is too long.
    #[error("a {what} has at most {max} bytes, but this one has {found}")]
    TooLong {
        /// The kind of identifier.
        what: &'static str,
        /// Bytes allowed.
        max: usize,
        /// Bytes found.
        found: usize,
    },
    /// The text has a character that is never allowed.
    #[error("a {what} may not contain {found:?}; allowed are {allowed}")]
    Character {
        /// The kind of identifier.
        what: &'static str,
        /// The first character that is not allowed.
        found: char,
        /// The characters that are allowed, in words.
        allowed: &'static str,
    },
    /// The text has a character that a reader cannot see.
    #[error("a {what}: {hidden}")]
    Hidden {
        /// The kind of identifier.
        what: &'static str,
        /// The character, and where it stands.
        hidden: Hidden,
    },
    /// The text has white space where none may be.
    #[error(
        "character {place} of a {what} is {found:?}; the only blanks allowed are spaces (U+0020) \
         between words"
    )]
    Blank {
        /// The kind of identifier.
        what: &'static str,
        /// The white space.
        found: char,
        /// Counted in characters, from 1.
        place: usize,
    },
    /// The text begins like an option of a command.
    #[error("a {what} may not begin with '-': a command would read it as an option")]
    Option {
        /// The kind of identifier.
        what: &'static str,
    },
    /// The text is not in the form of the identifier.
    #[error("{found:?} is not a {what}: expected {expected}")]
    Form {
        /// The kind of identifier.
        what: &'static str,
        /// The text, cut after 80 characters.
        found: String,
        /// The form, in words.
        expected: &'static str,
    },
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

    /// The tenant with this name.
    ///
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

    /// Whether a new tenant may have this name. Older versions allowed more names; such tenants
    /// stay.
    ///
    /// - errors: a leading hyphen.
    pub fn check_new(&self) -> Result<(), IdError> {
        match self.0.starts_with('-') {
            true => Err(IdError::Option { what: "tenant" }),
            false => Ok(()),
        }
    }

    /// The name as text.
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
/// it appears in no key, head or proof (see [`StreamId`]). A new person's name must also pass
/// [`UserId::check_new`].
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(try_from = "String", into = "String")]
pub struct UserId(String);

impl UserId {
    /// The person with this name.
    ///
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

    /// Whether a new person may have this name: two names that look the same must be one name.
    /// Older versions allowed more names; people recorded under them stay reachable.
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

    /// The name as text.
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
/// No stream carries the name of its user: `key` is a keyed hash of it (`store::keys`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct StreamId {
    /// The lab.
    pub tenant: TenantId,
    /// Which of the lab's streams.
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
        pub struct $name(
            /// The bytes.
            pub [u8; $size],
        );

        impl $name {
            /// The bytes as lower-case hexadecimal digits.
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
    /// It names a stream only together with a tenant: every tenant's own stream has the same key.
    /// So it has no order and no hash, and no map can be indexed by it alone. Index by
    /// [`StreamId`], or use [`WithinTenant`] inside one tenant.
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
    /// Names one request of one client. A retry carries the same id; no other request ever does.
    /// 16 bytes.
    #[derive(PartialOrd, Ord, Hash)]
    RequestId, 16, "request id", "32 hexadecimal digits"
);
byte_id!(
    /// The public half of a CURVE key (RFC 26): it names the other end of a connection. 32 bytes.
    /// Reads and prints as 64 hexadecimal digits. `frontends` converts it to ZeroMQ's own form of
    /// 40 characters (Z85).
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
    /// The tenant's own stream, with what operators did. A user name hashes to it with a
    /// probability of one in 2^128.
    pub const TENANT: StreamKey = StreamKey([0; 16]);
}

impl StreamId {
    /// The tenant's own stream.
    pub fn of_tenant(tenant: &TenantId) -> StreamId {
        StreamId { tenant: tenant.clone(), key: StreamKey::TENANT }
    }

    /// Whether this is a tenant's own stream, and not a person's.
    pub fn is_tenants(&self) -> bool {
        self.key == StreamKey::TENANT
    }
}

impl Digest {
    /// What the first record of a stream names as its predecessor.
    pub const ZERO: Digest = Digest([0; 32]);

    /// The digest of these bytes.
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
    /// The place of a stream's first record: 1.
    pub const FIRST: Seq = Seq(NonZeroU64::MIN);

    /// The place with this number; none for 0.
    pub fn new(number: u64) -> Option<Seq> {
        NonZeroU64::new(number).map(Seq)
    }

    /// The number, from 1.
    pub fn get(self) -> u64 {
        self.0.get()
    }

    /// The place after this one.
    ///
    /// - panics: after 2^64 - 1 records, which no stream reaches.
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
pub struct Timestamp(
    /// Microseconds.
    pub u64,
);

impl Timestamp {
    /// The time of the record after one with this time. Times never run backwards within a stream:
    /// where the wall clock is not later than the record before, the time is *held*, one
    /// microsecond after that record's.
    pub fn next(self, wall: Timestamp) -> Timestamp {
        wall.max(Timestamp(self.0.saturating_add(1)))
    }

    /// Whether this is a held time (see [`Timestamp::next`]) when the batch before has the time
    /// `before`. Two batches are never made within one microsecond, so a reading of the clock is
    /// never taken for a held time. Builds before the release of 0.2 held the times of tenants' own
    /// streams at `before` itself.
    pub fn is_held(self, before: Timestamp) -> bool {
        self.0 <= before.0.saturating_add(1)
    }

    /// The time some seconds later; the last possible time where the sum would be beyond it.
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
