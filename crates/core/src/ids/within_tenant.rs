use std::collections::BTreeMap;
use std::collections::btree_map::{self, Entry};
use std::fmt;

use super::StreamKey;

/// A map over the streams of *one* tenant, in the order of their keys.
///
/// The map does not know which tenant that is. A [`StreamKey`] alone names no stream, because every
/// tenant's own stream has the same key. For streams of several tenants, use
/// [`super::StreamId`] as the key of an ordinary map.
#[derive(Clone, PartialEq, Eq)]
pub struct WithinTenant<V>(BTreeMap<[u8; 16], V>);

impl<V> WithinTenant<V> {
    /// An empty map.
    pub const fn new() -> WithinTenant<V> {
        WithinTenant(BTreeMap::new())
    }

    /// The value of a stream.
    pub fn get(&self, key: &StreamKey) -> Option<&V> {
        self.0.get(&key.0)
    }

    /// The value of a stream, to be changed.
    pub fn get_mut(&mut self, key: &StreamKey) -> Option<&mut V> {
        self.0.get_mut(&key.0)
    }

    /// Whether the stream has a value.
    pub fn contains_key(&self, key: &StreamKey) -> bool {
        self.0.contains_key(&key.0)
    }

    /// Sets the value of a stream; returns the one before.
    pub fn insert(&mut self, key: StreamKey, value: V) -> Option<V> {
        self.0.insert(key.0, value)
    }

    /// Removes a stream; returns its value.
    pub fn remove(&mut self, key: &StreamKey) -> Option<V> {
        self.0.remove(&key.0)
    }

    /// The place of a stream, for reading and writing in one step.
    pub fn entry(&mut self, key: StreamKey) -> Entry<'_, [u8; 16], V> {
        self.0.entry(key.0)
    }

    /// How many streams have a value.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether no stream has a value.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Streams and values, in the order of the keys.
    pub fn iter(&self) -> impl Iterator<Item = (StreamKey, &V)> {
        self.0.iter().map(|(&key, value)| (StreamKey(key), value))
    }

    /// The streams, in the order of the keys.
    pub fn keys(&self) -> impl Iterator<Item = StreamKey> {
        self.0.keys().map(|&key| StreamKey(key))
    }

    /// The values, in the order of the keys.
    pub fn values(&self) -> btree_map::Values<'_, [u8; 16], V> {
        self.0.values()
    }

    /// The values, in the order of the keys; the map is gone afterwards.
    pub fn into_values(self) -> btree_map::IntoValues<[u8; 16], V> {
        self.0.into_values()
    }
}

impl<V> Default for WithinTenant<V> {
    fn default() -> Self {
        WithinTenant::new()
    }
}

impl<V: fmt::Debug> fmt::Debug for WithinTenant<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_map().entries(self.iter()).finish()
    }
}

impl<V> Extend<(StreamKey, V)> for WithinTenant<V> {
    fn extend<I: IntoIterator<Item = (StreamKey, V)>>(&mut self, entries: I) {
        self.0.extend(entries.into_iter().map(|(key, value)| (key.0, value)));
    }
}

impl<V> FromIterator<(StreamKey, V)> for WithinTenant<V> {
    fn from_iter<I: IntoIterator<Item = (StreamKey, V)>>(entries: I) -> Self {
        WithinTenant(entries.into_iter().map(|(key, value)| (key.0, value)).collect())
    }
}
