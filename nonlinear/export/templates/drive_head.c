/*
 * The drive, translated function by function from the compiled simulator of actuator-lti: the same
 * operations in the same order.  Compile with -ffp-contract=off to get the same bits as there.
 * Do not edit; the name behind each description is the file and line that it comes from.
 */
