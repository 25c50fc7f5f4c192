//! Reads the log for auditors and operators, on a thread of its own. Tenants take turns.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread;

use super::AnswerTo;
use super::awake::Awake;
use crate::client::{
    ArchiveAsk, ErrorCode, Frame, HeadView, Heads, PlainRecords, PlainView, Response,
    SealedRecords, SealedView,
};
use crate::events::Record;
use crate::fairness::{FairQueue, Room};
use crate::ids::{Seq, StreamId, StreamKey, TenantId};
use crate::limits::{
    ARCHIVE_QUEUE_MAX, HEADS_IN_REPLY_MAX, RECORDS_IN_REPLY_BYTES, RECORDS_IN_REPLY_MAX,
};
use crate::replay;
use crate::store::{EventLog, ReadError};

/// Reads durable records. All its methods block.
#[derive(Clone)]
pub struct ArchiveReader {
    log: Arc<dyn EventLog>,
}

impl std::fmt::Debug for ArchiveReader {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("ArchiveReader(..)")
    }
}

impl ArchiveReader {
    pub(super) fn new(log: Arc<dyn EventLog>) -> ArchiveReader {
        ArchiveReader { log }
    }

    /// Where the streams of a tenant end, in the order of their keys.
    ///
    /// - `after`: only streams with a greater key.
    /// - `limit`: streams; the reader gives at most [`HEADS_IN_REPLY_MAX`].
    /// - errors: the log cannot be read.
    pub fn heads(
        &self,
        tenant: &TenantId,
        after: Option<StreamKey>,
        limit: u32,
    ) -> Result<Heads, ReadError> {
        let limit = (limit as usize).clamp(1, HEADS_IN_REPLY_MAX);
        let mut streams = self.log.streams(tenant)?;
        streams.retain(|stream| after.is_none_or(|after| stream.key.0 > after.0));
        let more = streams.len() > limit;
        let mut heads = Vec::new();
        for stream in streams.into_iter().take(limit) {
            let head = self.log.head(&stream)?;
            let Some(seq) = Seq::new(head.seq) else { continue };
            heads.push(HeadView { stream: stream.key, seq, digest: head.digest });
        }
        Ok(Heads { heads, more })
    }

    /// Encrypted records of a stream: at least one, if there is one, and no more than a reply may
    /// have.
    ///
    /// - `limit`: records; the reader gives at most [`RECORDS_IN_REPLY_MAX`].
    /// - errors: the log cannot be read.
    pub fn sealed(
        &self,
        stream: &StreamId,
        from: Seq,
        limit: u32,
    ) -> Result<SealedRecords, ReadError> {
        let limit = (limit as usize).clamp(1, RECORDS_IN_REPLY_MAX);
        let (mut records, mut bytes) = (Vec::new(), 0);
        for read in self.log.sealed(stream, from)? {
            if records.len() >= limit || bytes >= RECORDS_IN_REPLY_BYTES {
                return Ok(SealedRecords { records, more: true });
            }
            let record = read?;
            bytes += record.frame.len();
            records.push(SealedView {
                stream: stream.key,
                seq: record.header.seq,
                digest: record.digest,
                frame: Frame(record.frame),
            });
        }
        Ok(SealedRecords { records, more: false })
    }

    /// As [`ArchiveReader::sealed`], decrypted.
    pub fn plain(
        &self,
        stream: &StreamId,
        from: Seq,
        limit: u32,
    ) -> Result<PlainRecords, ReadError> {
        let limit = (limit as usize).clamp(1, RECORDS_IN_REPLY_MAX);
        let (mut records, mut bytes) = (Vec::new(), 0);
        let reading = match self.log.read(stream, from) {
            Err(ReadError::Erased) => {
                return Ok(PlainRecords { erased: true, records, more: false });
            }
            reading => reading?,
        };
        for read in reading {
            if records.len() >= limit || bytes >= RECORDS_IN_REPLY_BYTES {
                return Ok(PlainRecords { erased: false, records, more: true });
            }
            let Record { seq, at, prev, digest, event, .. } = read?;
            let kind = format!("{:?}", event.kind());
            let event = replay::body(&event);
            bytes += event.to_string().len();
            records.push(PlainView { stream: stream.key, seq, at, prev, digest, kind, event });
        }
        Ok(PlainRecords { erased: false, records, more: false })
    }

    fn answer(&self, tenant: &TenantId, ask: ArchiveAsk) -> Response {
        let stream = |key| StreamId { tenant: tenant.clone(), key };
        let answer = match ask {
            ArchiveAsk::Heads { after, limit } => {
                self.heads(tenant, after, limit).map(Response::Heads)
            }
            ArchiveAsk::Sealed { stream: key, from, limit } => {
                self.sealed(&stream(key), from, limit).map(Response::Records)
            }
            ArchiveAsk::Plain { stream: key, from, limit } => {
                self.plain(&stream(key), from, limit).map(Response::PlainRecords)
            }
        };
        answer.unwrap_or_else(|error| {
            tracing::error!(%tenant, %error, "records cannot be read");
            let message = format!("these records cannot be read: {error}");
            Response::error(ErrorCode::Unavailable, message)
        })
    }
}

/// A thread that answers questions about the log. Each tenant has its own queue, so the questions
/// of one tenant do not delay those of another.
#[derive(Clone)]
pub(super) struct Archive(Arc<Questions>);

/// A question about the log.
pub(super) struct Question {
    pub tenant: TenantId,
    pub ask: ArchiveAsk,
    pub answer: AnswerTo,
}

struct Questions {
    waiting: Mutex<QuestionQueue>,
    changed: Condvar,
}

struct QuestionQueue {
    queue: FairQueue<Question>,
    room: Room,
    closed: bool,
}

impl Archive {
    /// Starts the thread.
    ///
    /// - `open`: dropped when the thread no longer uses the log.
    pub fn start(reader: ArchiveReader, open: Awake) -> std::io::Result<Archive> {
        let room = Room::new(ARCHIVE_QUEUE_MAX);
        let waiting =
            Mutex::new(QuestionQueue { queue: FairQueue::default(), room, closed: false });
        let questions = Arc::new(Questions { waiting, changed: Condvar::new() });
        let serving = questions.clone();
        thread::Builder::new().name("archive".to_owned()).spawn(move || {
            let _open = open;
            let reader = reader;
            while let Some(Question { tenant, ask, answer }) = serving.next() {
                answer.send(reader.answer(&tenant, ask));
            }
        })?;
        Ok(Archive(questions))
    }

    /// Queues a question.
    ///
    /// - errors: the question cannot be answered, because the tenant has too many in the queue or
    ///   the archive is closed. Answer it in another way.
    pub fn ask(&self, question: Question) -> Result<(), AnswerTo> {
        let mut waiting = self.0.waiting();
        if waiting.closed || !waiting.room.take(&question.tenant, 1) {
            return Err(question.answer);
        }
        let tenant = question.tenant.clone();
        waiting.queue.push(&tenant, question);
        self.0.changed.notify_one();
        Ok(())
    }

    /// Answers no more questions. The callers in the queue are told to ask again.
    pub fn close(&self) {
        let mut waiting = self.0.waiting();
        waiting.closed = true;
        let left = std::mem::take(&mut waiting.queue);
        drop(waiting);
        self.0.changed.notify_one();
        drop(left);
    }
}

impl Questions {
    fn next(&self) -> Option<Question> {
        let mut waiting = self.waiting();
        loop {
            if waiting.closed {
                return None;
            }
            if let Some(question) = waiting.queue.pop() {
                waiting.room.give_back(&question.tenant, 1);
                return Some(question);
            }
            waiting = self.changed.wait(waiting).unwrap_or_else(PoisonError::into_inner);
        }
    }

    fn waiting(&self) -> MutexGuard<'_, QuestionQueue> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
