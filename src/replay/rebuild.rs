use std::sync::Arc;

use super::Minds;
use crate::events::EventKind;
use crate::ids::{Digest, Seq, StreamId};
use crate::learning::{self, Mind, Recipe, RecipeError};
use crate::session::{Divergence, Session, State};
use crate::store::{ReadError, Store};
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
    #[error("stream {stream}: the mind of its records has digest {recorded}, but {recomputed}")]
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
    let next = session.head().next();
    fold(&mut session, store, stream, next, None)?;
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
    fold(&mut session, store, stream, Seq::FIRST, Some(at))?;
    if session.head().seq != at.get() {
        let (have, wanted) = (session.head().seq, at.get());
        return Err(RebuildError::PastHead { stream: stream.clone(), have, wanted });
    }
    equip(&mut session, store, stream, minds)?;
    Ok(session)
}

fn fold<D: Domain>(
    session: &mut Session<D>,
    store: &Store,
    stream: &StreamId,
    from: Seq,
    until: Option<Seq>,
) -> Result<(), RebuildError> {
    let read = |error| RebuildError::Read { stream: stream.clone(), error };
    for record in store.log.read(stream, from).map_err(read)? {
        let record = record.map_err(read)?;
        if until.is_some_and(|until| record.seq > until) {
            break;
        }
        session
            .apply(&record)
            .map_err(|error| RebuildError::Divergence { stream: stream.clone(), error })?;
    }
    Ok(())
}

/// The latest snapshot, if it fits this binary and the log still has the record it was taken at.
fn resume<D: Domain>(
    domain: &Arc<D>,
    store: &Store,
    stream: &StreamId,
) -> Result<Option<Session<D>>, ReadError> {
    let version = snapshot_version(&**domain);
    let latest = store.snapshots.latest::<State<D::Scene, D::Task>>(stream, version);
    let Some((head, state)) = latest else { return Ok(None) };
    let Some(at) = Seq::new(head.seq) else { return Ok(None) };
    // A log restored from a backup may be shorter than the snapshot, or have another tail.
    let stands = match store.log.read(stream, at)?.next() {
        Some(record) => record?.digest == head.digest,
        None => false,
    };
    if !stands || state.head.seq != head.seq {
        tracing::info!(%stream, seq = head.seq, "a snapshot does not fit the log and is not used");
        return Ok(None);
    }
    Ok(Some(Session::resume(domain.clone(), state)))
}

/// Keeps a snapshot, so that the next rebuild folds less.
///
/// - errors: a sentence for the operator; failing costs time only.
pub fn keep_snapshot<D: Domain>(
    store: &Store,
    stream: &StreamId,
    session: &Session<D>,
) -> Result<(), String> {
    let version = snapshot_version(&**session.domain());
    store.snapshots.put(stream, session.head(), version, session.state())
}

/// Names the shape and the meaning of a state: another crate version, body version or world makes
/// old snapshots absent.
fn snapshot_version<D: Domain>(domain: &D) -> Digest {
    let bodies: Vec<String> =
        EventKind::ALL.iter().map(|kind| kind.version().to_string()).collect();
    let text = format!(
        "apprentice {} · bodies {} · {} {}",
        env!("CARGO_PKG_VERSION"),
        bodies.join(","),
        domain.id(),
        domain.version(),
    );
    Digest::of(text.as_bytes())
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

/// The mind that the state names: from memory, from its cached bytes, or trained again.
///
/// - errors: [`RebuildError::Mind`] when training gives another digest (invariant `ModelAgrees`).
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
    let cached = store.models.load(stream, recorded);
    let cached = cached.and_then(|bytes| Mind::from_bytes(domain, recipe, &bytes).ok());
    let mind = match cached {
        Some(mind) => mind,
        None => {
            let disagree =
                |recomputed| RebuildError::Mind { stream: stream.clone(), recorded, recomputed };
            let trained = learning::train(domain, recipe, &session.trained_lessons())
                .map_err(|error| disagree(error.to_string()))?;
            if trained.digest() != recorded {
                return Err(disagree(format!("training gives {}", trained.digest())));
            }
            if let Err(reason) = store.models.put(stream, recorded, &trained.to_bytes()) {
                tracing::warn!(%stream, %reason, "the mind's bytes were not kept");
            }
            trained
        }
    };
    let mind = Arc::new(mind);
    minds.put(&stream.tenant, mind.clone());
    Ok(mind)
}
