//! The running service, from its actors to its sockets. Uses only the library; see
//! `tests/README.md`.

mod actors;
mod conversation;
mod examples;
mod feed;
mod protocol;
mod quotas;
mod recorded_through_socket;
mod refused_messages;
mod request_ids;
mod wire;
