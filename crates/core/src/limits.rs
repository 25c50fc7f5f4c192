//! Every bound of the service, with its unit and its reason. Related bounds are compared at
//! compile time at the end of the file. (Invariant `Bounded`.)

/// Bytes of a tenant's name: it is a file name and a tree name.
pub const TENANT_BYTES_MAX: usize = 64;
/// Bytes of a user's name.
pub const USER_BYTES_MAX: usize = 128;

/// Bytes of one utterance. The longest recorded human sentence has under 500.
pub const UTTERANCE_BYTES_MAX: usize = 2_000;
/// Words of one utterance.
pub const UTTERANCE_WORDS_MAX: usize = 150;
/// Mentions of objects in one utterance; later ones stay plain words.
pub const MENTIONS_MAX: usize = 16;
/// Clauses an utterance is split into.
pub const CLAUSES_MAX: usize = 8;

/// Primitives of one program. The longest ALFRED plan has 30.
pub const PROGRAM_STEPS_MAX: usize = 128;
/// Candidate programs kept per utterance, after removing equal ones.
pub const CANDIDATES_MAX: usize = 32;
/// Combinations tried in the cross product of clauses.
pub const COMBINATIONS_MAX: usize = 256;
/// Choices of types tried for the names of one clause: the best, then the others that share a name.
pub const TYPE_CHOICES_MAX: usize = 12;
/// Exemplars shown as evidence.
pub const EVIDENCE_NEAREST_MAX: usize = 3;
/// Discarded candidates shown as evidence.
pub const EVIDENCE_DISCARDED_MAX: usize = 5;

/// Utterances of one episode; then the episode must be ended.
pub const EPISODE_UTTERANCES_MAX: usize = 500;
/// Executed primitives of one episode.
pub const EPISODE_ACTIONS_MAX: usize = 2_000;
/// Live lessons of one person. Training time grows with their square.
pub const LESSONS_MAX: usize = 1_000;
/// Objects of one scene.
pub const SCENE_OBJECTS_MAX: usize = 400;
/// Bytes of a scene file or a task description that a client sends.
pub const SCENE_FILE_BYTES_MAX: usize = 256 * 1024;

/// Request ids remembered per stream.
pub const REQUEST_RING: usize = 1_024;
/// Seconds during which a client retries a request.
pub const CLIENT_RETRY_S_MAX: u64 = 60;

/// Bytes of one `sled` value. `sled` writes a page above 128 kB to a blob file that it never
/// syncs, and a page holds up to 20 values: values of 8 kB do become blobs (a test of `store/`
/// shows it), values of 4 kB cannot. Anything larger is chunked.
pub const STORE_VALUE_BYTES_MAX: usize = 4 * 1024;
/// Bytes that a stream's key file counts as in its lab's quota: a file takes a block of this size.
pub const KEY_FILE_BYTES: u64 = 4 * 1024;
/// Bytes of one record's body before sealing.
pub const RECORD_BYTES_MAX: usize = 4 * 1024 * 1024;
/// Events of one batch: one command's worth.
pub const BATCH_EVENTS_MAX: usize = 16;
/// Bytes of one batch's bodies before sealing.
pub const BATCH_BYTES_MAX: usize = 8 * 1024 * 1024;
/// Batches waiting for the committer; then an append is refused as busy.
pub const COMMIT_QUEUE_MAX: usize = 4_096;
/// Bytes of the batches waiting for the committer; then an append is refused as busy.
pub const COMMIT_QUEUE_BYTES_MAX: usize = 64 * 1024 * 1024;
/// Batches flushed together.
pub const COMMIT_GROUP_MAX: usize = 512;
/// Bytes of the batches flushed together; a group ends with the batch that reaches it.
pub const COMMIT_GROUP_BYTES_MAX: usize = 8 * 1024 * 1024;

/// Seconds a group may take to become durable; then the log counts as hanging and is poisoned, in
/// time for its clients to find the next process.
pub const COMMIT_S_MAX: u64 = 15;

/// Keys that one tenant ever admitted; retired ones are remembered.
pub const TENANT_KEYS_MAX: usize = 1_024;
/// Bytes of what an operator writes beside an order: a key's label, a reason.
pub const LABEL_BYTES_MAX: usize = 200;
/// Seconds that a retired key may stay good beside its successor: 30 days. Longer ones are made by
/// retiring the key later.
pub const OVERLAP_S_MAX: u64 = 30 * 24 * 60 * 60;
/// Orders waiting for the registrar; then an honest `Busy`.
pub const REGISTRAR_QUEUE_MAX: usize = 4_096;

/// Messages waiting in one user's mailbox; then an honest `Busy`.
pub const MAILBOX_MAX: usize = 32;
/// Requests waiting for one training to end; then an honest `Busy`.
pub const WAITERS_MAX: usize = 8;
/// Seconds that one request may wait for a training to end; well below [`CLIENT_RETRY_S_MAX`].
pub const WAIT_S_MAX: u32 = 30;
/// Users awake at once; the longest idle one goes to sleep.
pub const AWAKE_USERS_MAX: usize = 10_000;
/// Minds kept in memory, over all tenants; a mind has some hundred kilobytes.
pub const MINDS_IN_MEMORY_MAX: usize = 512;
/// Trainings of one tenant that wait for a trainer, at most one for each person.
pub const TRAIN_QUEUE_MAX: usize = 1_024;
/// Bytes of one wire frame.
pub const FRAME_BYTES_MAX: usize = 512 * 1024;
/// Frames of one wire message, the envelope included.
pub const FRAMES_MAX: usize = 4;
/// Requests of one tenant alone that actors have and have not yet answered; several tenants
/// together have less than twice as many.
pub const GATEWAY_IN_FLIGHT_MAX: usize = 8_192;
/// Requests waiting for the directory. It takes whatever all gateways may have in flight.
pub const DIRECTORY_QUEUE_MAX: usize = 2 * GATEWAY_IN_FLIGHT_MAX;
/// Places in the log of one tenant alone that wait to be published; then they are left out, and
/// followers fetch them.
pub const NOTIFICATIONS_WAITING_MAX: usize = 4_096;
/// Messages of the feed that wait for one subscriber; then it misses some, and fetches them.
pub const FEED_WAITING_MAX: i32 = 512;
/// Bytes of answers of one tenant alone that wait to leave the process; several tenants together
/// have less than twice as many. What finds no room is dropped and counted, and asked for again.
pub const UNSENT_BYTES_MAX: usize = 8 * 1024 * 1024;
/// Bytes of answers that wait to leave the process for one connection; the first is always taken
/// that its tenant has room for.
pub const UNSENT_CONNECTION_BYTES_MAX: usize = 2 * 1024 * 1024;
/// Bytes of the feed of one tenant alone that wait to leave the process, as [`UNSENT_BYTES_MAX`];
/// what finds no room is left out, and followers fetch it.
pub const FEED_UNSENT_BYTES_MAX: usize = 8 * 1024 * 1024;
/// Bytes of requests of one tenant alone that actors have; then an honest `Busy`.
pub const IN_HAND_BYTES_MAX: usize = 8 * 1024 * 1024;
/// Messages of one connection that wait to be read by the gateway; then its sender waits.
pub const UNREAD_MAX: i32 = 16;
/// Seconds after which a network connection is cut that takes nothing of what is sent to it.
pub const UNREAD_S_MAX: u32 = 30;
/// Bytes of the kernel's buffer for what is sent to one network connection.
pub const SEND_BUFFER_BYTES: i32 = 256 * 1024;
/// Connections of one key at the door with keys.
pub const KEY_CONNECTIONS_MAX: usize = 64;
/// Connections of one tenant alone at the door with keys; several tenants together have less than
/// twice as many. Each may hold one frame beyond [`UNSENT_BYTES_MAX`]: the one being encrypted.
pub const DOOR_CONNECTIONS_MAX: usize = 128;
/// Connections of one key at the feed.
pub const KEY_FOLLOWERS_MAX: usize = 8;
/// Connections of one tenant alone at the feed, as [`DOOR_CONNECTIONS_MAX`].
pub const FEED_CONNECTIONS_MAX: usize = 32;
/// Topics that one key subscribes to; it is then cut off. `libzmq` keeps about 2 kB for each.
pub const TOPICS_MAX: usize = 1_024;
/// The same for topics that the feed never publishes: they can be long.
pub const FOREIGN_TOPICS_MAX: usize = 16;
/// Seconds for which a key is kept from the feed that subscribed to too much.
pub const CUT_OFF_S: u64 = 600;
/// Questions about the log that wait, of one tenant alone; then an honest `Busy`.
pub const ARCHIVE_QUEUE_MAX: usize = 64;
/// Heads of streams in one answer.
pub const HEADS_IN_REPLY_MAX: usize = 1_000;
/// Records in one answer.
pub const RECORDS_IN_REPLY_MAX: usize = 256;
/// Bytes of records after which an answer ends; its last record may be as large as records are.
pub const RECORDS_IN_REPLY_BYTES: usize = 256 * 1024;
/// Nested maps and lists of one wire message; a request needs 4.
pub const WIRE_DEPTH_MAX: usize = 32;

const _: () = {
    // A person's requests that are taken and not answered: none is forgotten before its answer.
    assert!(MAILBOX_MAX + WAITERS_MAX < REQUEST_RING);
    assert!(UTTERANCE_BYTES_MAX < FRAME_BYTES_MAX);
    assert!(SCENE_FILE_BYTES_MAX < FRAME_BYTES_MAX);
    assert!(COMMIT_GROUP_MAX <= COMMIT_QUEUE_MAX);
    assert!(RECORD_BYTES_MAX <= BATCH_BYTES_MAX);
    assert!(BATCH_BYTES_MAX <= COMMIT_QUEUE_BYTES_MAX);
    assert!((WAIT_S_MAX as u64) < CLIENT_RETRY_S_MAX);
    assert!(2 * COMMIT_S_MAX < CLIENT_RETRY_S_MAX);
    assert!(WAITERS_MAX < MAILBOX_MAX);
    assert!(PROGRAM_STEPS_MAX <= EPISODE_ACTIONS_MAX);
    assert!(2 * FRAME_BYTES_MAX <= UNSENT_CONNECTION_BYTES_MAX);
    assert!(RECORD_BYTES_MAX + RECORDS_IN_REPLY_BYTES < UNSENT_BYTES_MAX);
    assert!(RECORD_BYTES_MAX < FEED_UNSENT_BYTES_MAX);
    assert!(FRAME_BYTES_MAX < IN_HAND_BYTES_MAX);
    assert!((UNREAD_S_MAX as u64) < CLIENT_RETRY_S_MAX);
};
