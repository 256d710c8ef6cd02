/*
 * The drive: controller, power stage, motor, gear and friction, one tick at a time.
 *
 * Three flat rows hold everything: p the parameters, s the state, io inputs and outputs of a tick.
 * Units are SI, at the motor shaft unless a name says otherwise (linear axis: read N for N m, m for rad,
 * kg for kg m2).  No function allocates, recurses, keeps state of its own, or does input or output.
 *
 *     drive_prepare_sizes(p);  drive_derive(p, s);  drive_init(p, s);      once
 *     io[DRIVE_IN_COMMAND] = ...;  status = drive_tick(p, s, io);           every tick
 *
 * Made by actuator-lti from the simulator that checked the design; do not edit.
 */
#ifndef DRIVE_H
#define DRIVE_H

#ifdef __cplusplus
extern "C" {
#endif

@SIZES@

@BLOCKS@
@FUNCTIONS@

#ifdef __cplusplus
}
#endif

#endif
