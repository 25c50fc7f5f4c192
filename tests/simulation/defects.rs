//! Defects that are built in on purpose, to check that the oracle finds them.

use apprentice::invariants::Invariant;

/// What the simulated service does wrong. What decides is the shipped code: all of these are in how
/// it is driven, which is where a service of their kind can go wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Defect {
    None,
    /// Answers before the log has said that the batch is durable.
    AnswersEarly,
    /// Gives a repeated request a new id.
    ForgetsRequests,
    /// Does not start the training that a seat asks for when it wakes.
    ForgetsTrainings,
    /// Takes a snapshot with an append that may not be durable.
    SnapshotsAhead,
    /// Lets the message that sends a seat to sleep overtake the requests that wait for it.
    SleepOvertakes,
    /// Stops a seat that cannot continue, without telling the directory first.
    LeavesByItself,
    /// Counts a person as idle while their requests wait.
    EvictsBusy,
    /// Treats a message of an earlier seat of a person as one of the present seat.
    ForgetsGenerations,
    /// Destroys a person's key while a seat speaks for them.
    ErasesAtOnce,
    /// Identifies people by their name alone, without their lab.
    MixesTenants,
    /// Loses the order to close segments.
    ForgetsSegments,
    /// Answers an operator before the log has said that the order is durable.
    ObeysEarly,
    /// Destroys a person's key only when their erasure is on record.
    NotesFirst,
    /// Does not tell the doors what was ordered.
    ForgetsDoors,
}

/// Each defect, and the laws it may be seen to break.
pub const DEFECTS: [(Defect, &[Invariant]); 14] = [
    (Defect::AnswersEarly, &[Invariant::DurableBeforeReply, Invariant::AnsweredOnce]),
    (Defect::ForgetsRequests, &[Invariant::ExactlyOnce]),
    (Defect::ForgetsTrainings, &[Invariant::NoLostWork]),
    (Defect::SnapshotsAhead, &[Invariant::FoldAgrees]),
    (Defect::SleepOvertakes, &[Invariant::AnsweredOnce]),
    (Defect::LeavesByItself, &[Invariant::AnsweredOnce]),
    (Defect::EvictsBusy, &[Invariant::SingleWriter]),
    (Defect::ForgetsGenerations, &[Invariant::SingleWriter]),
    (Defect::ErasesAtOnce, &[Invariant::SingleWriter]),
    (Defect::MixesTenants, &[Invariant::ExactlyOnce, Invariant::DurableBeforeReply]),
    (Defect::ForgetsSegments, &[Invariant::NoLostWork]),
    (Defect::ObeysEarly, &[Invariant::DurableBeforeReply, Invariant::AnsweredOnce]),
    (Defect::NotesFirst, &[Invariant::NoLostWork]),
    (Defect::ForgetsDoors, &[Invariant::FoldAgrees]),
];
