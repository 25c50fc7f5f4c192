use std::sync::Arc;

use super::{Minds, origins};
use crate::events::{Head, Record};
use crate::ids::{Digest, RequestId, Seq, StreamId};
use crate::invariants::Invariant;
use crate::learning::{self, Mind, Recipe, RecipeError};
use crate::session::{Divergence, Session, State};
use crate::store::{EventLog, Found, ReadError, Store};
use crate::world::Domain;

/// Why a session cannot be rebuilt.
#[derive(Debug, thiserror::Error)]
pub enum RebuildError {
    #[error("stream {stream}: {error}")]
    Read { stream: StreamId, error: ReadError },
    #[error("stream {stream}: {error}; was it recorded by another version of apprentice?")]
    Divergence { stream: StreamId, error: Divergence },
    #[error(
        "stream {stream}: the recipe that it was recorded with cannot be read: {error}; \
         use a newer version of apprentice"
    )]
    Recipe { stream: StreamId, error: RecipeError },
    #[error("stream {stream}: the recorded mind has digest {recorded}, but {recomputed}")]
    Mind { stream: StreamId, recorded: Digest, recomputed: String },
    #[error("stream {stream} has {have} records; there is no record {wanted}")]
    PastHead { stream: StreamId, have: u64, wanted: u64 },
}

/// Rebuilds a session as it stands now: the latest snapshot that fits, the records after it, and
/// the mind that the state names. A stream without records gives a session that is not open.
pub fn rebuild<D: Domain>(
    domain: &Arc<D>,
    store: &Store,
    stream: &StreamId,
    minds: &Minds,
) -> Result<Session<D>, RebuildError> {
    let read = |error| RebuildError::Read { stream: stream.clone(), error };
    let mut session = match resume(domain, store, stream).map_err(read)? {
        Some(session) => session,
        None => Session::new(domain.clone()),
    };
    let snapshot = session.head();
    let folded = fold(&mut session, store, stream, snapshot.next(), None)?;
    minds.note_rebuild(folded);
    tracing::debug!(%stream, snapshot = snapshot.seq, folded, "a session was rebuilt");
    equip(&mut session, store, stream, minds)?;
    Ok(session)
}

/// Rebuilds a session as it stood just after record `at`, from the first record on.
///
/// - errors: as [`rebuild`], and [`RebuildError::PastHead`].
pub fn rebuild_at<D: Domain>(
    domain: &Arc<D>,
    store: &Store,
    stream: &StreamId,
    minds: &Minds,
    at: Seq,
) -> Result<Session<D>, RebuildError> {
    let mut session = Session::new(domain.clone());
    let folded = fold(&mut session, store, stream, Seq::FIRST, Some(at))?;
    minds.note_rebuild(folded);
    if session.head().seq != at.get() {
        let (have, wanted) = (session.head().seq, at.get());
        return Err(RebuildError::PastHead { stream: stream.clone(), have, wanted });
    }
    equip(&mut session, store, stream, minds)?;
    Ok(session)
}

/// Returns how many records were applied.
fn fold<D: Domain>(
    session: &mut Session<D>,
    store: &Store,
    stream: &StreamId,
    from: Seq,
    until: Option<Seq>,
) -> Result<u64, RebuildError> {
    let mut folded = 0;
    let read = |error| RebuildError::Read { stream: stream.clone(), error };
    for record in store.log.read(stream, from).map_err(read)? {
        let record = record.map_err(read)?;
        if until.is_some_and(|until| record.seq > until) {
            break;
        }
        session
            .apply(&record)
            .map_err(|error| RebuildError::Divergence { stream: stream.clone(), error })?;
        folded += 1;
    }
    Ok(folded)
}

/// The latest snapshot, if it fits this binary and the log still has the record it was taken at.
fn resume<D: Domain>(
    domain: &Arc<D>,
    store: &Store,
    stream: &StreamId,
) -> Result<Option<Session<D>>, ReadError> {
    let origin = origins::state_origin(&**domain, Digest::ZERO);
    let mut unreadable = None;
    let resume = |head: Head, recipe: Digest, state: State<D::Scene, D::Task>| {
        let stands = still_there(store, stream, head).unwrap_or_else(|error| {
            unreadable = Some(error);
            false
        });
        if state.head != head {
            let law = Invariant::FoldAgrees;
            tracing::error!(%stream, %law, "a snapshot is of another record than it says");
        }
        let fits = stands && state.head == head && state.opened.is_some();
        let session = fits.then(|| Session::resume(domain.clone(), state))?;
        (session.recipe().digest() == recipe).then_some(session)
    };
    let resumed = store.snapshots.latest(stream, origin.schema, origin.code, resume);
    unreadable.map_or(Ok(resumed), Err)
}

/// Whether the log has the record that a snapshot was taken at: one restored from a backup may be
/// shorter, or have another tail.
fn still_there(store: &Store, stream: &StreamId, head: Head) -> Result<bool, ReadError> {
    let Some(at) = Seq::new(head.seq) else { return Ok(false) };
    let record = store.log.read(stream, at)?.next().transpose()?;
    Ok(record.is_some_and(|record| record.digest == head.digest))
}

/// Keeps a snapshot, so that the next rebuild folds less. Before the session is open there is
/// nothing to keep.
///
/// - errors: a sentence for the operator; failing costs time only.
pub fn keep_snapshot<D: Domain>(
    store: &Store,
    stream: &StreamId,
    session: &Session<D>,
) -> Result<(), String> {
    if !session.is_open() {
        return Ok(());
    }
    let origin = origins::state_origin(&**session.domain(), session.recipe().digest());
    store.snapshots.put(stream, &origin, session.head(), session.state())
}

/// Installs the mind that the session's state names, if any.
fn equip<D: Domain>(
    session: &mut Session<D>,
    store: &Store,
    stream: &StreamId,
    minds: &Minds,
) -> Result<(), RebuildError> {
    if let Some(opened) = &session.state().opened
        && !session.knows_its_recipe()
        && let Err(error) = Recipe::parse(&opened.recipe_text)
    {
        return Err(RebuildError::Recipe { stream: stream.clone(), error });
    }
    if session.mind_wanted().is_some() {
        session.install(mind_of(session, store, stream, minds)?);
    }
    Ok(())
}

/// The mind that the state names: from memory, from its kept bytes, or trained again.
///
/// Kept bytes of other code are not trusted: the mind is trained again. Should this code train
/// them differently they are used after all: they are what the log names. (Counted in
/// [`Minds::work`].)
///
/// - errors: [`RebuildError::Mind`] when training gives another digest and no bytes were kept
///   (invariant `ModelAgrees`).
/// - panics: before the session was opened.
pub fn mind_of<D: Domain>(
    session: &Session<D>,
    store: &Store,
    stream: &StreamId,
    minds: &Minds,
) -> Result<Arc<Mind>, RebuildError> {
    let recorded = session.state().mind.expect("the caller has an open session");
    if let Some(mind) = minds.get(&stream.tenant, recorded) {
        return Ok(mind);
    }
    let (domain, recipe) = (&**session.domain(), session.recipe());
    let origin = origins::mind_origin(recipe.digest());
    let read = |bytes: &[u8]| Mind::from_bytes(domain, recipe, bytes).ok();
    let mind = match store.models.load(stream, &origin, recorded, read) {
        Found::Fits(mind) => mind,
        found => {
            minds.note_training();
            let trained = learning::train(domain, recipe, &session.trained_lessons());
            let mind = match (trained, found) {
                (Ok(trained), _) if trained.digest() == recorded => trained,
                (trained, Found::Stale(kept)) => {
                    minds.note_not_reproduced();
                    let trained = trained.map(|mind| mind.digest().to_hex());
                    let trained = trained.unwrap_or_else(|error| error.to_string());
                    tracing::warn!(%stream, %recorded, %trained, "a mind that another version trained is used");
                    kept
                }
                (trained, _) => {
                    let recomputed = match trained {
                        Ok(trained) => format!("training gives {}", trained.digest()),
                        Err(error) => error.to_string(),
                    };
                    let stream = stream.clone();
                    return Err(RebuildError::Mind { stream, recorded, recomputed });
                }
            };
            if let Err(reason) = origins::keep_mind(store, stream, &mind) {
                tracing::warn!(%stream, %reason, "the mind was not saved in the cache");
            }
            mind
        }
    };
    let mind = Arc::new(mind);
    minds.put(&stream.tenant, mind.clone());
    Ok(mind)
}

/// The records `first` to `last` of a stream, for answering `request` again.
///
/// - errors: a sentence, when they cannot be read, some are missing, or another request led to them.
pub fn read_back(
    log: &dyn EventLog,
    stream: &StreamId,
    request: RequestId,
    (first, last): (Seq, Seq),
) -> Result<Vec<Record>, String> {
    let wanted = (last.get() - first.get() + 1) as usize;
    let records = log.read(stream, first).map_err(|error| error.to_string())?;
    let records: Vec<Record> =
        records.take(wanted).collect::<Result<_, _>>().map_err(|error| error.to_string())?;
    if records.len() != wanted {
        return Err(format!("records {first} to {last} of {stream} are missing"));
    }
    match records.iter().all(|record| record.request == request) {
        true => Ok(records),
        false => Err(format!(
            "records {first} to {last} of {stream} are of another request ({})",
            Invariant::ExactlyOnce
        )),
    }
}
