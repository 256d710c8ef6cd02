/*
 * The drive as a WebAssembly reactor: rows lie in the module's memory, the host reads and writes them there.
 */
#include "drive.h"

enum { P_MOST = 131072, S_MOST = 65536 };

static double p[P_MOST];
static double s[S_MOST];
static double io[DRIVE_IO_LENGTH];

#define EXPORT(name) __attribute__((export_name(name)))

EXPORT("p_at") double *p_at(void) { return p; }
EXPORT("s_at") double *s_at(void) { return s; }
EXPORT("io_at") double *io_at(void) { return io; }
EXPORT("p_most") int p_most(void) { return P_MOST; }
EXPORT("s_most") int s_most(void) { return S_MOST; }
EXPORT("io_length") int io_length(void) { return DRIVE_IO_LENGTH; }

/* Derives what follows from the parameters of a run in p and puts the drive at its start; 0 where it does not fit. */
EXPORT("start") int start(void)
{
    drive_prepare_sizes(p);
    if (!(p[DRIVE_STATE_SIZE] <= (double)S_MOST) || !(p[DRIVE_PARAMETER_SIZE] <= (double)P_MOST)) {
        return 0;
    }
    drive_derive(p, s);
    drive_init(p, s);
    return 1;
}

/* After a change of parameters that keeps the state: the drive goes on with the new ones. */
EXPORT("retune") int retune(void)
{
    const double before = p[DRIVE_STATE_SIZE];

    drive_prepare_sizes(p);
    if (!(p[DRIVE_STATE_SIZE] == before) || !(p[DRIVE_PARAMETER_SIZE] <= (double)P_MOST)) {
        return 0;
    }
    drive_derive(p, s);
    drive_retune(p, s);
    return 1;
}

/* One tick with what io holds; returns the status. */
EXPORT("tick") int tick(void) { return drive_tick(p, s, io); }

/* Ticks under a held command and moment; returns the number done well. */
EXPORT("run") int run(int ticks, double command, double moment)
{
    int done = 0;

    while (done < ticks) {
        io[DRIVE_IN_COMMAND] = command;
        io[DRIVE_IN_LOAD] = moment;
        if (drive_tick(p, s, io) != DRIVE_OK) {
            break;
        }
        done += 1;
    }
    return done;
}
