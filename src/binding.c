/* SPDX-License-Identifier: GPL-3.0-or-later
 * Binding of ranks to processors, as hwloc sees it (binding.h). */
#include "binding.h"
#include "comm.h"
#include "log.h"
#include "mem.h"
#include <hwloc.h>
#include <omp.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { NAME = 64, LIST = 128, LONG = 2048 };

/* Of one rank. processors: those that it may run on, each shared out among the ranks that may run there. */
struct place { char host[NAME], list[LIST]; int threads, share, processors, cores, memories; };

static struct place own_place(void)
{
    struct place place = {.threads = omp_get_max_threads(), .share = comm_processors()};
    hwloc_topology_t machine;
    gethostname(place.host, sizeof place.host - 1);
    snprintf(place.list, sizeof place.list, "?");
    if (hwloc_topology_init(&machine) != 0) return place;
    if (hwloc_topology_load(machine) == 0) {
        hwloc_bitmap_t set = hwloc_bitmap_alloc();
        if (hwloc_get_cpubind(machine, set, HWLOC_CPUBIND_PROCESS) == 0) hwloc_bitmap_list_snprintf(place.list, LIST, set);
        place.processors = hwloc_get_nbobjs_by_type(machine, HWLOC_OBJ_PU);
        place.cores = hwloc_get_nbobjs_by_type(machine, HWLOC_OBJ_CORE);
        place.memories = hwloc_get_nbobjs_by_type(machine, HWLOC_OBJ_NUMANODE);
        hwloc_bitmap_free(set);
    }
    hwloc_topology_destroy(machine);
    return place;
}

/* The ranks of the machine on which rank `first` is, unless a lower one is there. */
static void tell_machine(const struct place *place, int first, int size)
{
    char text[LONG] = "";
    int used = 0, ranks = 0, beyond = 0;
    for (int r = 0; r < first; r++)
        if (strcmp(place[r].host, place[first].host) == 0) return;
    for (int r = first; r < size; r++) {
        if (strcmp(place[r].host, place[first].host) != 0) continue;
        ranks++;
        beyond += place[r].threads > place[r].share ? place[r].threads - place[r].share : 0;
        if (used < LONG - LIST)
            used += snprintf(text + used, (size_t)(LONG - used), "%s%d on %s", used ? ", " : "", r, place[r].list);
    }
    const struct place *p = &place[first];
    log_line("%s: %d core%s, %d processor%s, %d memor%s; rank%s %s", p->host, p->cores, p->cores == 1 ? "" : "s", p->processors,
             p->processors == 1 ? "" : "s", p->memories, p->memories == 1 ? "y" : "ies", ranks == 1 ? "" : "s", text);
    if (beyond > 0)
        log_warning("%s: %d thread%s more than processors for them: ranks and threads wait for each other there (--threads, "
                    "mpirun --bind-to)", p->host, beyond, beyond == 1 ? "" : "s");
}

void binding_log(void)
{
    const int size = comm_size();
    struct place *place = mem_array("ranks", struct place, size);
    int64_t *bytes = mem_array("ranks", int64_t, size);
    for (int r = 0; r < size; r++) bytes[r] = (int64_t)sizeof *place;
    place[comm_rank()] = own_place();
    comm_gather_all(place, bytes);
    for (int r = 0; r < size; r++) tell_machine(place, r, size);
    mem_free(bytes);
    mem_free(place);
}
